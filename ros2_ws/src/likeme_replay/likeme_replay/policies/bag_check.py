"""Checks the policies on a recorded bag."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from likeme_bags.reading import Bag
from likeme_core.stamps import SECOND
from likeme_replay.message_definitions import definitions
from likeme_replay.policies.monitor import PolicyMonitor
from likeme_replay.policies.policy import TOPICS


class BagCheck(NamedTuple):
    """The monitor after the whole bag, and messages that do not fit their type."""

    monitor: PolicyMonitor
    unreadable: int


def check_bag(bag: Bag) -> BagCheck:
    """Check every policy on the messages of a bag, in the order of their log times.

    Messages from before there were worlds, which policies do not speak of, are left out.
    """
    monitor, unreadable = PolicyMonitor(), 0
    for record in bag.records(list(_topics(bag))):
        topic = record.topic.lstrip('/')
        if record.type != TOPICS[topic]:
            continue
        try:
            message = definitions().read(record.data, record.type)
        except ValueError:
            unreadable += 1
            continue
        monitor.hear(topic, message, record.stamp / SECOND)
    monitor.tick(bag.end / SECOND)
    return BagCheck(monitor, unreadable)


def _topics(bag: Bag) -> Iterator[str]:
    for topic in bag.topics:
        if TOPICS.get(topic.name.lstrip('/')) == topic.type:
            yield topic.name
