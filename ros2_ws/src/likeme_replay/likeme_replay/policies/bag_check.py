"""Checks the policies on a recorded bag."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from likeme_bags.errors import BagError
from likeme_bags.reading import Bag
from likeme_bags.values import Record, Topic
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
    topics = {topic.key: topic for topic in bag.topics}
    for record in bag.records(list(_topics(bag))):
        topic = record.topic.lstrip('/')
        if record.type != TOPICS[topic]:
            continue
        try:
            message = _message(record, topics[record.key])
        except (ValueError, BagError):
            unreadable += 1
            continue
        monitor.hear(topic, message, record.stamp / SECOND)
    monitor.tick(bag.end / SECOND)
    return BagCheck(monitor, unreadable)


def _message(record: Record, topic: Topic) -> Any:
    """The message, with the fields that it was recorded with.

    Raises:
        ValueError, BagError: the bytes are no such message, or from before there were worlds.
    """
    message = definitions().read_recorded(topic, record.data)
    fields = [name for name, _ in definitions().store.fielddefs[record.type][1]]
    if 'world' in fields and not hasattr(message, 'world'):
        raise ValueError(f'Expected a {record.type} with a world, got one without.')
    return message


def _topics(bag: Bag) -> Iterator[str]:
    for topic in bag.topics:
        if TOPICS.get(topic.name.lstrip('/')) == topic.type:
            yield topic.name
