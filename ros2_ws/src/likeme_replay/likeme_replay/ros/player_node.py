"""Publishes the messages of a bag: raw bytes, recorded QoS, at a rate."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import Qos
from rosgraph_msgs.msg import Clock

from likeme_bags.values import Record, Topic
from likeme_core.ros.message_types import message_class
from likeme_core.ros.time import time_msg
from likeme_core.stamps import SECOND
from likeme_replay.playback_control import MAX_STEP_BACK, PlaybackControl
from likeme_replay.ros.waiting_node import WaitingNode

#: s to wait for a subscriber before the first message.
DISCOVERY_TIMEOUT = 3.0
#: s at the end in which reliable subscribers must acknowledge.
ACK_TIMEOUT = 5.0
#: ns of /clock between two rounds of a loop, and where the recorded clock went back.
CLOCK_GAP = 100_000_000
#: Least depth of a publisher.
MIN_DEPTH = 10
OVERRIDES = ('history', 'depth', 'reliability', 'durability')


class PlayerNode(WaitingNode):
    """Publishes the messages of a bag.

    Publishes: the topics of the bag; /clock if wanted, which never goes back, also when looping.
    """

    def __init__(
        self, control: PlaybackControl, clock: bool, qos: Mapping[str, Mapping[str, Any]],
        notify: Callable[[str], None], **options: Any,
    ) -> None:  # fmt: skip
        """`qos`: overrides by topic; `notify`: takes messages for the user."""
        super().__init__('player', **options)
        self._control, self._qos, self._notify = control, qos, notify
        self._clock_pub = self.create_publisher(Clock, '/clock', 10) if clock else None
        self._pubs: dict[tuple[str, str], Any] = {}
        self._now = self._shift = 0
        self.published = 0

    def offer(self, topics: Sequence[Topic], insist: bool) -> bool:
        """Create a publisher for each topic that can be played; whether there is any.

        insist: also topics that have another publisher.
        """
        # Discovery of other publishers takes a moment.
        self.wait(lambda: False, 1.0)
        for topic in topics:
            kind = message_class(topic.type)
            others = self.count_publishers(topic.name)
            if kind is None:
                self._notify(f'Not played: {topic.name}, because {topic.type} is not installed.')
            elif others and not insist:
                self._notify(f'Not played: {topic.name}, because it has another publisher.')
            else:
                profile = profile_of(topic.qos, self._qos.get(topic.name, {}))
                self._pubs[topic.name, topic.type] = self.create_publisher(
                    kind, topic.name, profile
                )
        return bool(self._pubs)

    def wait_for_subscribers(self) -> None:
        """Wait a moment for subscribers to be discovered."""
        publishers = self._pubs.values()
        if not self.wait(
            lambda: any(p.get_subscription_count() for p in publishers), DISCOVERY_TIMEOUT
        ):
            self._notify('None of the topics has a subscriber; playing anyway.')
        # They discover this node a moment later.
        self.wait(lambda: False, 1.0)

    def play(self, records: Iterable[Record]) -> None:
        """Publish all records once, each when it is due."""
        self._control.restart()
        last: int | None = None
        for record in records:
            if last is None or last - record.stamp > MAX_STEP_BACK * SECOND:
                # /clock continues where it was when the recorded clock went back.
                self._shift = max(0, self._now + CLOCK_GAP - record.stamp) if self._now else 0
            last = record.stamp
            self._control.wait(record.stamp, self.spin)
            self._publish_clock(record.stamp + self._shift)
            publisher = self._pubs.get((record.topic, record.type))
            if publisher is not None:
                publisher.publish(record.data)
                self.published += 1

    def finish(self) -> None:
        """Wait until reliable subscribers have everything, and close."""
        for publisher in self._pubs.values():
            publisher.wait_for_all_acked(Duration(seconds=ACK_TIMEOUT))
        self.close()

    def _publish_clock(self, stamp: int) -> None:
        self._now = max(self._now, stamp)
        if self._clock_pub is not None:
            self._clock_pub.publish(Clock(clock=time_msg(self._now)))


def profile_of(offered: Sequence[Qos], overrides: Mapping[str, Any]) -> QoSProfile:
    """A profile compatible with all subscribers of the recorded publishers.

    Several publishers of one topic: reliable if one was, transient local only if all were. By
    default reliable, volatile, depth 10.
    """
    reliable = not offered or any(
        q.reliability.value != ReliabilityPolicy.BEST_EFFORT for q in offered
    )
    latched = bool(offered) and all(
        q.durability.value == DurabilityPolicy.TRANSIENT_LOCAL for q in offered
    )
    depth = max([MIN_DEPTH, *(q.depth for q in offered)])
    keep_all = any(q.history.value == HistoryPolicy.KEEP_ALL for q in offered)
    profile = QoSProfile(
        history=HistoryPolicy.KEEP_ALL if keep_all else HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
    for name, value in overrides.items():
        setattr(profile, name, value)
    return profile


def read_overrides(nodes: Any) -> dict[str, dict[str, Any]]:
    """QoS overrides as `ros2 bag play` takes them, topic: policy: value.

    Raises:
        ValueError: the file holds anything else.
    """
    policies = {
        'history': HistoryPolicy, 'reliability': ReliabilityPolicy, 'durability': DurabilityPolicy
    }  # fmt: skip
    if not isinstance(nodes, dict) or not all(isinstance(v, dict) for v in nodes.values()):
        raise ValueError('Expected topic: policy: value in the file of QoS overrides.')
    found: dict[str, dict[str, Any]] = {}
    for topic, values in nodes.items():
        found[topic] = {}
        for name, value in values.items():
            if name not in OVERRIDES:
                raise ValueError(f'{topic}: expected one of {", ".join(OVERRIDES)}, got {name!r}.')
            if name == 'depth':
                if not isinstance(value, int) or value < 1:
                    raise ValueError(f'{topic}: expected a depth of 1 or more, got {value!r}.')
                found[topic][name] = value
                continue
            known = policies[name].__members__
            if str(value).upper() not in known:
                words = ', '.join(word.lower() for word in known)
                raise ValueError(f'{topic}: expected {name} as one of {words}, got {value!r}.')
            found[topic][name] = policies[name][str(value).upper()]
    return found
