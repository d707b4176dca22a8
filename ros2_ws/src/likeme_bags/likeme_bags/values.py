"""Topics and recorded messages of a bag."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from rosbags.interfaces import Qos


class Record(NamedTuple):
    """One recorded message."""

    topic: str
    # As 'sensor_msgs/msg/Image'.
    type: str
    # When it was recorded, ns since the epoch. The header's own stamp is inside the data.
    stamp: int
    # CDR of the ROS 2 type, with its header of 4 bytes.
    data: bytes
    # Which `Topic.schema` of its topic and type it is written by.
    schema: int = 0

    @property
    def key(self) -> tuple[str, str, int]:
        """The `key` of its topic."""
        return self.topic, self.type, self.schema


@dataclass(frozen=True)
class Topic:
    """A topic of a bag, with everything a player or a writer needs of it."""

    name: str
    type: str
    count: int = 0
    # Profiles offered by the publishers while recording; () when the bag names none.
    qos: tuple[Qos, ...] = ()
    # The message definition embedded in the bag ('' when there is none) and its language,
    # 'ros2msg', 'ros2idl' or ''.
    definition: str = ''
    encoding: str = ''
    # 'RIHS01_...' or ''.
    type_hash: str = ''
    # Tells topics of one name and type apart whose definitions differ: 0, 1, ...
    schema: int = 0

    @property
    def key(self) -> tuple[str, str, int]:
        """What tells topics of a bag apart."""
        return self.name, self.type, self.schema

    def counted(self, count: int) -> Topic:
        """The same topic with another number of messages."""
        return replace(self, count=count)
