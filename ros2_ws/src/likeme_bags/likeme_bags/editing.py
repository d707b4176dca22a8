"""Write new bags from others: cut, merge, repair. The sources are never changed."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from heapq import merge as merged_by
from math import inf
from pathlib import Path
from typing import NamedTuple

from likeme_bags.bag_warnings import Subject
from likeme_bags.errors import BagError
from likeme_bags.reading import Bag, open_bag
from likeme_bags.storage import Attachment
from likeme_bags.topic_names import select_topics
from likeme_bags.typestores import layout
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

# What repair writes anew; topics and QoS it keeps as they are.
_REPAIRED = (Subject.FILES, Subject.METADATA, Subject.INDEX)


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
        records = bag.records(names, first, last)
        count, left_out = _write(target, storage, kept, records, bag.custom, bag.attachments)
        return WrittenBag(target, count, bag.warnings + left_out, bag.complete)


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
        topics, numbers = _united(bags)
        records = merged_by(*map(_renumbered, bags, numbers), key=lambda record: record.stamp)
        custom = {key: value for bag in bags for key, value in bag.custom.items()}
        attachments = [each for bag in bags for each in bag.attachments]
        count, left_out = _write(target, storage, topics, records, custom, attachments)
        warnings = tuple(f'{b.path.name}: {w}' for b in bags for w in b.warnings)
        complete = all(bag.complete for bag in bags)
        return WrittenBag(target, count, warnings + left_out, complete)


_TopicKey = tuple[str, str, int]


def _united(bags: Sequence[Bag]) -> tuple[list[Topic], list[dict[_TopicKey, int]]]:
    """Each topic once for each definition, with the profiles of all bags.

    Beside them the number of the definition there, by the topics of every bag.
    """
    united: dict[_TopicKey, Topic] = {}
    types: dict[str, str] = {}
    layouts: dict[str, list[str]] = {}
    numbers: list[dict[_TopicKey, int]] = []
    for bag in bags:
        numbers.append({})
        for topic in bag.topics:
            if (known := types.setdefault(topic.name, topic.type)) != topic.type:
                raise BagError(f'Expected {topic.name} to be {known}, got {topic.type} as well.')
            own, others = layout(topic), layouts.setdefault(topic.name, [])
            if own and own not in others:
                others.append(own)
            number = others.index(own) if own else 0
            numbers[-1][topic.key] = number
            first = united.setdefault((topic.name, topic.type, number), topic)
            qos = first.qos + tuple(profile for profile in topic.qos if profile not in first.qos)
            described = first if first.definition else topic
            united[topic.name, topic.type, number] = replace(described, qos=qos, schema=number)
    return list(united.values()), numbers


def _renumbered(bag: Bag, numbers: Mapping[_TopicKey, int]) -> Iterator[Record]:
    """The records of a bag with the numbers of definitions that the new bag has."""
    for record in bag.records():
        number = numbers[record.key]
        yield record if number == record.schema else record._replace(schema=number)


def repair(source: Path, target: Path, storage: str = 'mcap') -> WrittenBag:
    """Everything that can be read of a bag, in a new one with index and metadata.yaml.

    This includes messages in a truncated chunk. `complete` is False when something that was once
    there could not be read; an end that was never written is no loss.

    Raises:
        BagError: nothing can be read, or the target exists.
    """
    with open_bag(source, thorough=True, to_repair=True) as bag:
        source_bag = (bag.topics, bag.records(), bag.custom, bag.attachments)
        count, left_out = _write(target, storage, *source_bag, may_be_empty=True)
        return WrittenBag(target, count, bag.warnings + left_out, bag.complete)


def needs_repair(source: Path) -> tuple[str, ...]:
    """What is wrong with a bag's files; () when there is nothing to repair."""
    with open_bag(source, thorough=True) as bag:
        for _ in bag.records():
            pass
        broken = not bag.complete or any(each.subject in _REPAIRED for each in bag.all_warnings)
        return bag.warnings if broken else ()


def _write(
    target: Path,
    storage: str,
    topics: Iterable[Topic],
    records: Iterable[Record],
    custom: Mapping[str, str],
    attachments: Iterable[Attachment],
    may_be_empty: bool = False,
) -> tuple[int, tuple[str, ...]]:
    """Write a bag and return its number of messages and what was left out.

    When that fails, remove what was written.
    """
    writer = BagWriter(target, storage, custom=custom)
    count, left_out = 0, []
    try:
        with writer:
            for attachment in attachments:
                if not writer.attach(attachment):
                    sentence = f'Left out, as {storage} has no such thing: {attachment}.'
                    left_out.append(sentence)
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
    return count, tuple(left_out)
