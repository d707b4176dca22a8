"""Serves the topics of a ROS domain to the Foxglove application, over a WebSocket."""

from __future__ import annotations

import queue
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import foxglove
from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from likeme_bags.images import IMAGE
from likeme_core.ros.message_types import message_class
from likeme_core.ros.qos import CAMERA
from likeme_core.ros.time import stamp_ns, steady_clock
from likeme_replay.message_definitions import UnknownTypeError, definitions
from likeme_replay.ros.record_node import compatible_profile

#: s between two searches for new topics, and between two looks at what clients asked for.
DISCOVERY_PERIOD, REQUEST_PERIOD = 0.5, 0.05
#: Messages that may wait for a slow client; older ones are dropped. A frame takes 1 MB.
BACKLOG = 64
CLOCK_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


class SubscriptionChange(NamedTuple):
    """A client began (+1) or ceased (-1) to want a topic."""

    topic: str
    change: int


class SubscriptionChanges(foxglove.websocket.ServerListener):  # type: ignore[misc]
    """Passes what clients want from the server's threads to the node's."""

    def __init__(self) -> None:
        self._changes: queue.SimpleQueue[SubscriptionChange] = queue.SimpleQueue()

    def on_subscribe(self, client: Any, channel: Any) -> None:
        """A client wants a topic."""
        self._changes.put(SubscriptionChange(channel.topic, 1))

    def on_unsubscribe(self, client: Any, channel: Any) -> None:
        """A client wants it no more."""
        self._changes.put(SubscriptionChange(channel.topic, -1))

    def take(self) -> list[SubscriptionChange]:
        """All changes since the last call."""
        return [self._changes.get() for _ in range(self._changes.qsize())]


class FoxgloveBridgeNode(Node):
    """Offers each topic that has a publisher as a channel: its type's definition and CDR bytes.

    Subscribes: the topics that clients want, raw, while they want them; /clock, the time of the
    messages where it is published. Serves files of packages by their `package://` URIs.

    Attributes:
        port: on which the server listens.
    """

    def __init__(self, host: str, port: int, **options: Any) -> None:
        """port: 0 takes a free one. Raises RuntimeError where it cannot listen."""
        super().__init__('foxglove_bridge', start_parameter_services=False, **options)
        self._channels: dict[str, foxglove.Channel] = {}
        self._types: dict[str, str] = {}
        self._unusable: set[str] = set()
        self._wanted: Counter[str] = Counter()
        self._passed_on: dict[str, Any] = {}
        self._clock_ns = 0
        self._changes, self._sinks = SubscriptionChanges(), foxglove.Context()
        self._server = foxglove.start_server(
            name='LikeMe', host=host, port=port, server_listener=self._changes,
            asset_handler=read_asset, context=self._sinks, message_backlog_size=BACKLOG,
        )  # fmt: skip
        self.port = int(self._server.port)
        self.create_subscription(Clock, '/clock', self._on_clock, CLOCK_QOS)
        for period, callback in (
            (DISCOVERY_PERIOD, self._discover),
            (REQUEST_PERIOD, self._follow_changes),
        ):
            self.create_timer(period, callback, clock=steady_clock())

    def destroy_node(self) -> None:
        """Disconnect all clients and destroy the node."""
        self._server.stop()
        super().destroy_node()

    def _on_clock(self, message: Clock) -> None:
        self._clock_ns = stamp_ns(message.clock)

    def _discover(self) -> None:
        for topic, types in self.get_topic_names_and_types():
            known = topic in self._channels or topic in self._unusable or '/_' in topic
            if not known and self.count_publishers(topic):
                self._offer(topic, types)

    def _offer(self, topic: str, types: list[str]) -> None:
        try:
            if len(types) > 1 or message_class(types[0]) is None:
                raise UnknownTypeError(f'Expected one installed type, got {", ".join(types)}.')
            text = definitions().of(types[0]).text
        except UnknownTypeError as error:
            self._unusable.add(topic)
            self.get_logger().warning(f'{topic} is not offered: {error}')
            return
        self._types[topic] = types[0]
        schema = foxglove.Schema(name=types[0], encoding='ros2msg', data=text.encode())
        self._channels[topic] = foxglove.Channel(
            topic, message_encoding='cdr', schema=schema, context=self._sinks
        )

    def _follow_changes(self) -> None:
        for topic, change in self._changes.take():
            self._wanted[topic] += change
            # Also for the second client of a topic: a new subscription receives what is latched.
            old = self._passed_on.pop(topic, None)
            if old is not None:
                self.destroy_subscription(old)
            if self._wanted[topic] > 0:
                self._passed_on[topic] = self._subscribe(topic)

    def _subscribe(self, topic: str) -> Any:
        kind = self._types[topic]
        offers = [info.qos_profile for info in self.get_publishers_info_by_topic(topic)]
        # Images that are lost are not sent again: that would load the camera.
        qos = CAMERA if kind == IMAGE else compatible_profile(offers)
        receive: Callable[[Any], None] = partial(self._receive, self._channels[topic])
        return self.create_subscription(message_class(kind), topic, receive, qos, raw=True)

    def _receive(self, channel: foxglove.Channel, data: bytes) -> None:
        channel.log(data, log_time=self._clock_ns or time.time_ns())


def read_asset(uri: str) -> bytes | None:
    """The file of a `package://` URI in the package's share folder; None: there is none."""
    parts = urlsplit(uri)
    path = PurePosixPath(parts.path.lstrip('/'))
    if parts.scheme != 'package' or '..' in path.parts:
        return None
    try:
        return Path(get_package_share_directory(parts.netloc), path).read_bytes()
    except (PackageNotFoundError, ValueError, OSError):
        return None
