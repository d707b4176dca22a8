"""What the `doctor` finds on a ROS domain: who publishes what, with which QoS, how often."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import rclpy
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)

from likeme_bringup.doctor_checks import Finding
from likeme_core.ros.message_types import message_class

#: s for which nodes are looked for, and for which messages are counted.
DISCOVERY, MEASURING = 1.5, 2.0
#: Connects to any publisher, and asks none to send again.
ANY = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
#: Of every node, and of no cell in particular.
COMMON = ('/rosout', '/parameter_events')
#: Ends of topics with one source, and of those that a node cannot do without.
ONE_SOURCE = ('/clock', '/table_state', '/joint_states', '/robot_description', '/cell/hold_state')
CAMERA = (
    '/camera/rgb/image_rect_color', '/camera/rgb/camera_info',
    '/camera/depth_registered/image_rect',
)  # fmt: skip
NEEDED = (*CAMERA, '/table_state', '/cell/hold_state')


class TopicReport(NamedTuple):
    """One topic: its types, its endpoints (TopicEndpointInfo) and messages per s."""

    name: str
    types: Sequence[str]
    publishers: Sequence[Any]
    subscribers: Sequence[Any]
    rate: float

    @property
    def finding(self) -> Finding:
        """The line about it."""
        sources = ', '.join(sorted({_offer(each) for each in self.publishers}))
        sentence = f'{self.rate:.1f} Hz, {" or ".join(self.types)}, from {sources or "nobody"}.'
        return Finding(self.name, sentence, self.problem)

    @property
    def problem(self) -> str:
        """What to do about it; empty where nothing is wrong."""
        if len(self.types) > 1:
            return 'Two types of one name do not connect: end or remap one of the nodes.'
        if not self.publishers:
            readers = ', '.join(sorted({each.node_name for each in self.subscribers}))
            return f'{readers} waits for it: start what publishes it.'
        for writer in self.publishers:
            for reader in self.subscribers:
                fit, why = qos_check_compatible(writer.qos_profile, reader.qos_profile)
                if fit == QoSCompatibility.ERROR:
                    return (
                        f'{reader.node_name} does not receive it from {writer.node_name} '
                        f'({why.strip(" ;")}): set qos_overrides of one of them.'
                    )
        if len(self.publishers) > 1 and self.name.endswith(ONE_SOURCE):
            return 'Expected one publisher: are two cells on this ROS domain?'
        if self.name.endswith(CAMERA) and not self.rate:
            return 'No frame came: is the camera running, and does the network let frames through?'
        return ''


def _offer(info: Any) -> str:
    qos = info.qos_profile
    reliable = qos.reliability == ReliabilityPolicy.RELIABLE
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    words = ['reliable' if reliable else 'best effort', *(['latched'] if latched else [])]
    return f'{info.node_name} ({", ".join(words)})'


def graph_findings(node: Node) -> Iterator[Finding]:
    """The nodes on the domain of `node`, and each topic, watched for MEASURING s."""
    _spin(node, DISCOVERY)
    # Hidden ones, as of the ros2 command's daemon, begin with an underscore.
    names = sorted(n for n in node.get_node_names() if n != node.get_name() and n[:1] != '_')
    domain = node.context.get_domain_id()
    if not names:
        yield Finding('cell', f'No other node is on ROS domain {domain}.')
        return
    yield Finding('cell', f'On ROS domain {domain}: {", ".join(names)}.')
    yield from (report.finding for report in _reports(node))


def _reports(node: Node) -> Iterator[TopicReport]:
    topics = {
        name: types
        for name, types in sorted(node.get_topic_names_and_types())
        if name not in COMMON
        and '/_' not in name
        and (node.count_publishers(name) or name.endswith(NEEDED))
    }
    counts: Counter[str] = Counter()
    before = {name: list(_others(node, name)) for name in topics}
    for name, types in topics.items():
        kind = message_class(types[0])
        if kind is not None:
            node.create_subscription(kind, name, partial(_count, counts, name), ANY, raw=True)
    # What is latched comes at once, and says nothing of a rate.
    _spin(node, 0.2)
    counts.clear()
    begin = time.monotonic()
    _spin(node, MEASURING)
    seconds = time.monotonic() - begin
    for name, types in topics.items():
        publishers = node.get_publishers_info_by_topic(name)
        yield TopicReport(name, types, publishers, before[name], counts[name] / seconds)


def _others(node: Node, topic: str) -> Iterator[Any]:
    for info in node.get_subscriptions_info_by_topic(topic):
        if info.node_name != node.get_name():
            yield info


def _count(counts: Counter[str], name: str, _: bytes) -> None:
    counts[name] += 1


def _spin(node: Node, seconds: float) -> None:
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        rclpy.spin_once(node, timeout_sec=left)
