"""Write new bags from others: cut, merge, repair. The sources are never changed."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from heapq import merge as merged_by
from math import inf
from pathlib import Path
from typing import NamedTuple

from likeme_bags.bag_warnings import About
from likeme_bags.errors import BagError
from likeme_bags.reading import Bag, open_bag
from likeme_bags.topic_names import select_topics
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

# What repair writes anew; topics and QoS it keeps as they are.
_REPAIRED = (About.FILES, About.METADATA, About.INDEX)


class WrittenBag(NamedTuple):
    """A new bag, and the warnings of those it was written from."""

    path: Path
    messages: int
    warnings: tuple[str, ...]
    # Whether everything the sources hold is in it.
    complete: bool


def cut(
    source: Path,
    target: Path,
    start: float | None = None,
    end: float | None = None,
    topics: Collection[str] | None = None,
    storage: str = 'mcap',
) -> WrittenBag:
    """The part of a bag between two times, s from its beginning, start <= t < end.

    Raises:
        BagError: the bag cannot be read, a time or topic is not one of it, nothing would be left,
            or the target exists.
    """
    with open_bag(source) as bag:
        kept = select_topics(bag, topics)
        first, last = _log_time(bag, '--start', start), _log_time(bag, '--end', end)
        if first is not None and last is not None and first >= last:
            raise BagError(f'Expected --start before --end, got {start} and {end} s.')
        names = {topic.name for topic in kept}
        count = _write(target, storage, kept, bag.records(names, first, last), bag.custom)
        return WrittenBag(target, count, bag.warnings, bag.complete)


def _log_time(bag: Bag, option: str, seconds: float | None) -> int | None:
    if seconds is None:
        return None
    if not 0 <= seconds < inf:
        raise BagError(f'Expected {option} as s from the beginning of the bag, got {seconds}.')
    return min(bag.start + round(min(seconds, 1e10) * 1e9), 2**63 - 1)


def merge(sources: Sequence[Path], target: Path, storage: str = 'mcap') -> WrittenBag:
    """All messages of several bags in one, by their log times.

    Raises:
        BagError: a bag cannot be read, a topic has two types or a type two definitions, there are
            no messages, or the target exists.
    """
    with ExitStack() as stack:
        bags = [stack.enter_context(open_bag(source)) for source in sources]
        topics = _united([topic for bag in bags for topic in bag.topics])
        records = merged_by(*(bag.records() for bag in bags), key=lambda record: record.stamp)
        custom = {key: value for bag in bags for key, value in bag.custom.items()}
        count = _write(target, storage, topics, records, custom)
        warnings = tuple(f'{b.path.name}: {w}' for b in bags for w in b.warnings)
        return WrittenBag(target, count, warnings, all(bag.complete for bag in bags))


def _united(topics: Sequence[Topic]) -> list[Topic]:
    """Each topic once, with the profiles of all bags."""
    united: dict[str, Topic] = {}
    definitions: dict[str, Topic] = {}
    for topic in topics:
        known = united.setdefault(topic.name, topic)
        if known.type != topic.type:
            raise BagError(f'Expected {topic.name} to be {known.type}, got {topic.type} as well.')
        if topic.definition:
            other = definitions.setdefault(topic.type, topic)
            if other.type_hash and topic.type_hash and other.type_hash != topic.type_hash:
                raise BagError(
                    f'Expected one definition of {topic.type}, got two: {other.type_hash} on '
                    f'{other.name}, {topic.type_hash} on {topic.name}.'
                )
        qos = known.qos + tuple(profile for profile in topic.qos if profile not in known.qos)
        described = known if known.definition else topic
        united[topic.name] = replace(described, qos=qos)
    return list(united.values())


def repair(source: Path, target: Path, storage: str = 'mcap') -> WrittenBag:
    """Everything that can be read of a bag, in a new one with index and metadata.yaml.

    This includes messages in a truncated chunk. `complete` is False when something that was once
    there could not be read; an end that was never written is no loss.

    Raises:
        BagError: nothing can be read, or the target exists.
    """
    with open_bag(source, thorough=True, salvage=True) as bag:
        count = _write(target, storage, bag.topics, bag.records(), bag.custom, may_be_empty=True)
        return WrittenBag(target, count, bag.warnings, bag.complete)


def needs_repair(source: Path) -> tuple[str, ...]:
    """What is wrong with a bag's files; () when there is nothing to repair."""
    with open_bag(source, thorough=True) as bag:
        for _ in bag.records():
            pass
        broken = not bag.complete or any(note.about in _REPAIRED for note in bag.notes)
        return bag.warnings if broken else ()


def _write(
    target: Path,
    storage: str,
    topics: Iterable[Topic],
    records: Iterable[Record],
    custom: Mapping[str, str],
    may_be_empty: bool = False,
) -> int:
    """Write a bag and return its number of messages; when that fails, remove what was written."""
    writer = BagWriter(target, storage, custom=custom)
    count = 0
    try:
        with writer:
            for topic in topics:
                writer.add(topic)
            for record in records:
                writer.write(record)
                count += 1
            if not (count or may_be_empty):
                raise BagError('Expected messages to write, got none in the part asked for.')
    except BaseException:
        shutil.rmtree(target, ignore_errors=True)
        raise
    return count
