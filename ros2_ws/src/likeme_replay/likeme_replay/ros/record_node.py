"""Records topics: every message as the bytes that were received, and the nodes' parameters."""

from __future__ import annotations

import json
import math
import signal
import time
from collections import Counter
from collections.abc import Callable, Collection
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

from likeme_core.ros.message_types import message_class
from likeme_core.ros.qos import LATCHED
from likeme_core.world.values import label_of
from likeme_msgs.msg import World
from likeme_replay import recorded_parameters
from likeme_replay.message_definitions import UnknownTypeError, definitions
from likeme_replay.recording_writer import ReceivedMessage, RecordedTopic, Recording

#: s between two searches for new topics and nodes.
DISCOVERY_PERIOD = 0.2
#: Depth of the subscriptions: more than three seconds of a camera.
QUEUE_DEPTH = 100
#: s after which a node that has not answered is asked for its parameters again: DDS loses an
#: answer to a client that the node has not discovered yet.
PARAMETER_TIMEOUT = 2.0
#: Nodes whose parameters are recorded.
PARAMETER_NODES = ('perception_node', 'inference_node', 'arm_driver')


class RecordNode(Node):
    """Subscribes to topics as soon as they have a publisher.

    Subscribes: the wanted topics, raw, with QoS that suits all their publishers.
    Reads: the topic world, and the parameters of perception_node, inference_node and arm_driver.
    """

    def __init__(
        self, recording: Recording, wanted: Collection[str] | None, **options: Any
    ) -> None:
        """`wanted`: names of topics; None: all except hidden ones."""
        super().__init__('recorder', start_parameter_services=False, **options)
        self._recording = recording
        self._wanted = None if wanted is None else {self.resolve_topic_name(n) for n in wanted}
        self._subscribed: set[str] = set()
        self._parameter_clients = {
            name: AsyncParameterClient(self, name) for name in PARAMETER_NODES
        }
        self._parameters_asked: dict[str, float] = {}
        self._recorded_parameters: recorded_parameters.Parameters = {}
        self.unusable: dict[str, str] = {}
        self.lost: Counter[str] = Counter()
        self.create_subscription(World, 'world', self._on_world, LATCHED)
        self.create_timer(DISCOVERY_PERIOD, self._discover)

    @property
    def missing(self) -> list[str]:
        """Wanted topics without a publisher so far."""
        return sorted((self._wanted or set()) - self._subscribed)

    def _discover(self) -> None:
        for topic, types in self.get_topic_names_and_types():
            if self._wants(topic):
                self._subscribe(topic, types)
        for name in self._parameter_clients.keys() - self._recorded_parameters.keys():
            self._ask_parameters(name)

    def _ask_parameters(self, name: str) -> None:
        now = time.monotonic()
        client = self._parameter_clients[name]
        waited = now - self._parameters_asked.get(name, -math.inf)
        if waited > PARAMETER_TIMEOUT and client.services_are_ready():
            self._parameters_asked[name] = now
            client.list_parameters().add_done_callback(partial(self._get_parameters, name, client))

    def _wants(self, topic: str) -> bool:
        if topic in self._subscribed or '/_' in topic:
            return False
        return self._wanted is None or topic in self._wanted

    def _subscribe(self, topic: str, types: list[str]) -> None:
        offers = self.get_publishers_info_by_topic(topic)
        if not offers:
            return
        self._subscribed.add(topic)
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
        self._recording.add_topic(RecordedTopic(topic, types[0], definition, qos))
        profile = compatible_profile([offer.qos_profile for offer in offers])
        receive = partial(self._receive, topic)
        # rclpy inspects the signature: with two parameters it passes the reception time.
        self._create(kind, topic, lambda data, info: receive(data, info), profile)

    def _create(self, kind: Any, topic: str, receive: Any, profile: QoSProfile) -> None:
        events = SubscriptionEventCallbacks(message_lost=partial(self._on_lost, topic))
        try:
            self.create_subscription(
                kind, topic, receive, profile, raw=True, event_callbacks=events
            )
        except UnsupportedEventTypeError:
            self.create_subscription(kind, topic, receive, profile, raw=True)

    def _receive(self, topic: str, data: bytes, info: dict[str, Any]) -> None:
        stamp = int(info.get('received_timestamp') or 0) or time.time_ns()
        self._recording.add(ReceivedMessage(topic, stamp, data))

    def _on_lost(self, topic: str, event: Any) -> None:
        self.lost[topic] += int(event.total_count_change)

    def _get_parameters(self, name: str, client: AsyncParameterClient, listed: Any) -> None:
        names = list(listed.result().result.names)
        client.get_parameters(names).add_done_callback(
            partial(self._store_parameters, name, names)
        )

    def _store_parameters(self, name: str, names: list[str], got: Any) -> None:
        values = map(parameter_value_to_python, got.result().values)
        self._recorded_parameters[name] = {
            n: list(v) if hasattr(v, 'tolist') else v for n, v in zip(names, values, strict=True)
        }
        self._recording.set_metadata(
            recorded_parameters.KEY, json.dumps(self._recorded_parameters, default=list)
        )

    def _on_world(self, world: World) -> None:
        label = label_of(world.name, world.digest)
        self._recording.set_metadata(recorded_parameters.WORLD_KEY, label)


class RecordingGaps(NamedTuple):
    """Topics never published, lost messages by topic, and why topics cannot be recorded."""

    missing: list[str]
    lost: Counter[str]
    unusable: dict[str, str]


def record_topics(
    recording: Recording,
    wanted: Collection[str] | None,
    duration: float | None,
    domain: int,
    tick: Callable[[], None],
) -> RecordingGaps:
    """Record until SIGINT or SIGTERM, or for some seconds, and close the bag.

    tick: called about ten times a second at least.
    """
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
        tick()
    executor.shutdown()
    gaps = RecordingGaps(node.missing, node.lost, node.unusable)
    node.destroy_node()
    rclpy.try_shutdown()
    recording.finish()
    return gaps._replace(lost=gaps.lost + recording.lost)


def compatible_profile(offers: list[QoSProfile]) -> QoSProfile:
    """The strictest QoS that all publishers offer: DDS connects no publisher that offers less."""
    reliable = all(q.reliability == ReliabilityPolicy.RELIABLE for q in offers)
    latched = all(q.durability == DurabilityPolicy.TRANSIENT_LOCAL for q in offers)
    return QoSProfile(
        depth=QUEUE_DEPTH,
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
