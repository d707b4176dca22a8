"""Listens to topics and hands every message on as the bytes it came in.

It lives here and not with the bags because it knows the deployment: which topics a recording of
the cell needs, and which nodes' parameters it was made with.
"""

from __future__ import annotations

import json
import math
import signal
import time
from collections import Counter
from collections.abc import Collection
from functools import partial
from typing import Any, NamedTuple

import rclpy
from rclpy.event_handler import SubscriptionEventCallbacks, UnsupportedEventTypeError
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

from likeme_replay import recorded_parameters as settings
from likeme_replay.message_definitions import UnknownTypeError, definitions
from likeme_replay.recording_writer import Channel, Heard, Recording
from likeme_replay.ros.player_node import message_class

#: s between two looks for new topics and nodes.
LOOK = 0.2
#: Messages a topic may be behind: more than three seconds of a camera.
DEPTH = 100
ASKED = ('perception_node', 'inference_node', 'arm_driver')


class RecordNode(Node):
    """Subscribes to topics as soon as somebody publishes them.

    Subscribes: the wanted topics, raw, with QoS that suits all their publishers.
    Asks: perception_node, inference_node and arm_driver for their parameters.
    """

    def __init__(
        self, recording: Recording, wanted: Collection[str] | None, **options: Any
    ) -> None:
        """`wanted`: names of topics; None: all but hidden ones."""
        super().__init__('recorder', start_parameter_services=False, **options)
        self._recording = recording
        self._wanted = None if wanted is None else {self.resolve_topic_name(n) for n in wanted}
        self._seen: set[str] = set()
        self._asked: dict[str, AsyncParameterClient | None] = {
            name: AsyncParameterClient(self, name) for name in ASKED
        }
        self._parameters: settings.Parameters = {}
        self.unusable: dict[str, str] = {}
        self.lost: Counter[str] = Counter()
        self.create_timer(LOOK, self._look)

    @property
    def missing(self) -> list[str]:
        """Wanted topics nobody published yet."""
        return sorted((self._wanted or set()) - self._seen)

    def _look(self) -> None:
        for topic, types in self.get_topic_names_and_types():
            if self._wants(topic):
                self._subscribe(topic, types)
        for name, client in self._asked.items():
            if client is not None and client.services_are_ready():
                self._asked[name] = None
                client.list_parameters().add_done_callback(partial(self._ask, name, client))

    def _wants(self, topic: str) -> bool:
        if topic in self._seen or '/_' in topic:
            return False
        return self._wanted is None or topic in self._wanted

    def _subscribe(self, topic: str, types: list[str]) -> None:
        offers = self.get_publishers_info_by_topic(topic)
        if not offers:
            return
        self._seen.add(topic)
        kind = message_class(types[0])
        try:
            if len(types) > 1 or kind is None:
                raise UnknownTypeError(f'Expected one installed type, got {", ".join(types)}.')
            definition = definitions().of(types[0])
        except UnknownTypeError as error:
            self.unusable[topic] = str(error)
            self.get_logger().warning(f'{topic} is not recorded: {error}')
            return
        qos = tuple(_as_recorded(offer.qos_profile) for offer in offers)
        self._recording.add(Channel(topic, types[0], definition, qos))
        profile = _listening([offer.qos_profile for offer in offers])
        take = partial(self._take, topic)
        self._listen(kind, topic, lambda data, info: take(data, info), profile)

    def _listen(self, kind: Any, topic: str, take: Any, profile: QoSProfile) -> None:
        events = SubscriptionEventCallbacks(message_lost=partial(self._on_lost, topic))
        try:
            self.create_subscription(kind, topic, take, profile, raw=True, event_callbacks=events)
        except UnsupportedEventTypeError:
            self.create_subscription(kind, topic, take, profile, raw=True)

    def _take(self, topic: str, data: bytes, info: dict[str, Any]) -> None:
        stamp = int(info.get('received_timestamp') or 0) or time.time_ns()
        self._recording.take(Heard(topic, stamp, data))

    def _on_lost(self, topic: str, event: Any) -> None:
        self.lost[topic] += int(event.total_count_change)

    def _ask(self, name: str, client: AsyncParameterClient, listed: Any) -> None:
        names = list(listed.result().result.names)
        client.get_parameters(names).add_done_callback(partial(self._note, name, names))

    def _note(self, name: str, names: list[str], got: Any) -> None:
        values = map(parameter_value_to_python, got.result().values)
        self._parameters[name] = {
            n: list(v) if hasattr(v, 'tolist') else v for n, v in zip(names, values, strict=True)
        }
        self._recording.remark(settings.KEY, json.dumps(self._parameters, default=list))


class Gaps(NamedTuple):
    """Topics nobody published, messages lost by topic, and topics of no use with the reason."""

    missing: list[str]
    lost: Counter[str]
    unusable: dict[str, str]


def listen(
    recording: Recording, wanted: Collection[str] | None, duration: float | None, domain: int
) -> Gaps:
    """Record until SIGINT or SIGTERM, or for some seconds, and close the bag."""
    signals: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: signals.append(received))
    rclpy.init(args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = RecordNode(recording, wanted)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    end = math.inf if duration is None else time.monotonic() + duration
    while not signals and not recording.error and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    gaps = Gaps(node.missing, node.lost, node.unusable)
    node.destroy_node()
    rclpy.try_shutdown()
    recording.finish()
    return gaps._replace(lost=gaps.lost + recording.lost)


def _listening(offers: list[QoSProfile]) -> QoSProfile:
    """What all publishers can give: the rules of DDS would drop those that offer less."""
    reliable = all(q.reliability == ReliabilityPolicy.RELIABLE for q in offers)
    latched = all(q.durability == DurabilityPolicy.TRANSIENT_LOCAL for q in offers)
    return QoSProfile(
        depth=DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def _as_recorded(offer: QoSProfile) -> Qos:
    times = [
        QosTime(*divmod(span.nanoseconds, 1_000_000_000))
        for span in (offer.deadline, offer.lifespan, offer.liveliness_lease_duration)
    ]
    return Qos(
        QosHistory(int(offer.history)), int(offer.depth), QosReliability(int(offer.reliability)),
        QosDurability(int(offer.durability)), times[0], times[1],
        QosLiveliness(int(offer.liveliness)), times[2],
        bool(offer.avoid_ros_namespace_conventions),
    )  # fmt: skip
