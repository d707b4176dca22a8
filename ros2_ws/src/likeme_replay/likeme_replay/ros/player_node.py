"""Plays a bag into the graph as it was recorded: raw bytes, recorded QoS, at a rate."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import Qos
from rosgraph_msgs.msg import Clock

from likeme_bags.values import Record, Topic
from likeme_core.ros.time import time_msg
from likeme_replay.playback_control import Transport
from likeme_replay.ros.waiting_node import PatientNode

#: s to wait for somebody who listens before the first message.
DISCOVERY = 3.0
#: s at most for listeners to get what they have not got at the end.
PARTING = 5.0
#: Between two rounds of a loop, ns of the recording's time.
GAP = 100_000_000
#: Fewer messages than this are not kept for who reads late.
DEPTH = 10
OVERRIDES = ('history', 'depth', 'reliability', 'durability')


class PlayerNode(PatientNode):
    """Publishes the messages of a bag.

    Publishes: the topics of the bag; /clock if wanted, which only goes on, however often the bag
    is played again.
    """

    def __init__(
        self, transport: Transport, clock: bool, qos: Mapping[str, Mapping[str, Any]],
        tell: Callable[[str], None], **options: Any,
    ) -> None:  # fmt: skip
        """`qos`: overrides by topic; `tell`: what the user should know."""
        super().__init__('player', **options)
        self._transport, self._qos, self._tell = transport, qos, tell
        self._clock = self.create_publisher(Clock, '/clock', 10) if clock else None
        self._pubs: dict[str, Any] = {}
        self._now = self._shift = 0
        self.published = 0

    def offer(self, topics: Sequence[Topic], insist: bool) -> list[str]:
        """Create a publisher for each topic that can be played; the names of those.

        insist: also play what somebody else publishes here already.
        """
        # What others publish is only known after a moment.
        self._spend(1.0)
        for topic in topics:
            kind = message_class(topic.type)
            others = self.count_publishers(topic.name)
            if kind is None:
                self._tell(f'Not played: {topic.name}, because {topic.type} is not known here.')
            elif others and not insist:
                self._tell(
                    f'Not played: {topic.name}, because somebody publishes it here already.'
                )
            else:
                profile = profile_of(topic.qos, self._qos.get(topic.name, {}))
                self._pubs[topic.name] = self.create_publisher(kind, topic.name, profile)
        return list(self._pubs)

    def wait_for_listeners(self) -> None:
        """Give those who listen a moment to be found."""
        publishers = self._pubs.values()
        if not self.wait(lambda: any(p.get_subscription_count() for p in publishers), DISCOVERY):
            self._tell('Nobody listens to any of the topics; playing all the same.')
        # They have found us, too, a moment later.
        self._spend(1.0)

    def _spend(self, seconds: float) -> None:
        self.wait(lambda: False, seconds)

    def play(self, records: Iterable[Record]) -> None:
        """Publish all records once, each when it is due."""
        self._transport.restart()
        first: int | None = None
        for record in records:
            if first is None:
                first = record.stamp
                # A new round goes on where the last one ended.
                self._shift = max(0, self._now + GAP - first) if self._now else 0
            self._transport.wait(record.stamp, self.spin)
            self._tell_time(record.stamp + self._shift)
            publisher = self._pubs.get(record.topic)
            if publisher is not None:
                publisher.publish(record.data)
                self.published += 1

    def finish(self) -> None:
        """Wait until those who listen reliably have everything, and let go."""
        for publisher in self._pubs.values():
            publisher.wait_for_all_acked(Duration(seconds=PARTING))
        self.close()

    def _tell_time(self, stamp: int) -> None:
        self._now = max(self._now, stamp)
        if self._clock is not None:
            self._clock.publish(Clock(clock=time_msg(self._now)))


def message_class(name: str) -> Any:
    """The class of 'package/msg/Name', None when it is not installed."""
    package, _, kind = name.partition('/msg/')
    try:
        return getattr(importlib.import_module(f'{package}.msg'), kind, None)
    except (ImportError, ValueError):
        return None


def profile_of(offered: Sequence[Qos], overrides: Mapping[str, Any]) -> QoSProfile:
    """A profile that suits whoever could listen to the recorded publishers.

    Several publishers of one topic: reliable if one was, latched only if all were. What a bag
    does not say is reliable, volatile, depth 10.
    """
    reliable = not offered or any(
        q.reliability.value != ReliabilityPolicy.BEST_EFFORT for q in offered
    )
    latched = bool(offered) and all(
        q.durability.value == DurabilityPolicy.TRANSIENT_LOCAL for q in offered
    )
    depth = max([DEPTH, *(q.depth for q in offered)])
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
        ValueError: something else is in there.
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
