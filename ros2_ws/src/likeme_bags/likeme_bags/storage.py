"""What the reader of every kind of storage file offers, and reading on where the library fails."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    MessageDefinition,
    MessageDefinitionFormat,
)

from likeme_bags.bag_warnings import BagWarnings
from likeme_bags.errors import READ_ERRORS, DamagedError

MAX_STAMP = 2**63 - 1


class Channel(NamedTuple):
    """What a storage file says of one of its topics, unchecked."""

    topic: str
    type: str
    # 'cdr', 'ros1', or what else the file claims.
    serialization: str = 'cdr'
    # Offered profiles as YAML.
    qos: str = ''
    definition: str = ''
    # 'ros2msg', 'ros2idl', 'ros1msg' or ''.
    encoding: str = ''
    type_hash: str = ''

    def connection(self, key: int) -> Connection:
        """The channel as the library's readers of rosbag2 files need it to find messages."""
        undefined = MessageDefinition(MessageDefinitionFormat.NONE, '')
        return Connection(
            key, self.topic, self.type, undefined, '', 0, ConnectionExtRosbag2('cdr', []), None
        )


class Attachment(NamedTuple):
    """An attachment or a metadata record of an MCAP file, as it stands in the file."""

    kind: str
    name: str
    record: bytes

    def __str__(self) -> str:
        return f"{self.kind} '{self.name}' ({len(self.record)} bytes)"


class Storage(Protocol):
    """One opened file. The ids of the library's connections are those of the channels."""

    name: str
    channels: Mapping[int, Channel]
    attachments: Sequence[Attachment]

    @property
    def connections(self) -> Collection[Connection]:
        """All topics, for `messages`."""

    @property
    def counts(self) -> Mapping[int, int]:
        """Messages by id of their channel."""

    @property
    def span(self) -> tuple[int, int]:
        """Log times of the first and the last message, ns; only when there are messages."""

    @property
    def checksums(self) -> bool:
        """Whether checksums cover every message, so that a flipped bit is noticed."""

    def messages(
        self, connections: Collection[Connection], start: int | None, stop: int | None
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Messages in the order of log times, as the library reads them."""

    def stamps(self, channel: int) -> NDArray[np.int64]:
        """Log times of a channel's messages, ns, rising; shape (n,)."""

    def salvage(self, why: str) -> bool:
        """Index the file by its content, without what is damaged; False when it is already."""

    def release(self) -> None:
        """Close the file, and remove temporary copies."""


def read(
    storage: Storage, ids: Collection[int], start: int | None, stop: int | None, log: BagWarnings
) -> Iterator[tuple[int, int, bytes]]:
    """Channel, log time (ns) and data of messages, start <= log time < stop, by their log times.

    Where the library fails, the file is salvaged, and reading goes on behind the last message.
    """
    last, passed, total = -1, 0, 0
    while True:
        again = passed
        chosen = [c for c in storage.connections if c.id in ids]
        begin = start if last < 0 else last
        try:
            for connection, stamp, data in storage.messages(chosen, begin, stop) if chosen else ():
                valid = isinstance(stamp, int) and 0 <= stamp <= MAX_STAMP
                if not valid or not isinstance(data, bytes) or connection.id not in ids:
                    log.lost(storage.name, f'the message at {stamp!r} ns is damaged')
                    continue
                if stamp < last:
                    raise DamagedError('Expected messages in the order of their log times.')
                if again and stamp == last:
                    again -= 1
                    continue
                passed = passed + 1 if stamp == last else 1
                last, total = stamp, total + 1
                yield connection.id, stamp, data
        except READ_ERRORS as error:
            if storage.salvage(str(error) or repr(error)):
                continue
            log.lost(storage.name, f'reading ends at {last} ns: {error}')
            return
        expected = sum(storage.counts.get(key, 0) for key in ids)
        if start is None and stop is None and total < expected:
            log.lost(storage.name, f'{total} messages read, expected {expected}')
        return
