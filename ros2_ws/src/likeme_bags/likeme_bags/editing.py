"""New bags from old ones: a part, several in one, a mended one. Originals stay as they are."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from heapq import merge as merged_by
from pathlib import Path
from typing import NamedTuple

from likeme_bags.adapting import bare
from likeme_bags.bag_warnings import Subject
from likeme_bags.errors import BagError
from likeme_bags.reading import Bag, open_bag
from likeme_bags.storage import Attachment
from likeme_bags.typestores import layout
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

# What repair writes anew; what is said of topics and QoS it keeps.
_MENDED = (Subject.FILES, Subject.METADATA, Subject.INDEX)


class Written(NamedTuple):
    """What was written, and what the bags it came from had to say."""

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
) -> Written:
    """The part of a bag between two times, s from its beginning, start <= t < end.

    Raises:
        BagError: the bag cannot be read, nothing would be left, or the target exists.
    """
    with open_bag(source) as bag:
        kept = _chosen(bag, topics)
        first, last = _stamp(bag, start), _stamp(bag, end)
        names = {topic.name for topic in kept}
        records = bag.records(names, first, last)
        count, left_out = _write(target, storage, kept, records, bag.custom, bag.attachments)
        return Written(target, count, bag.warnings + left_out, bag.complete)


def _stamp(bag: Bag, seconds: float | None) -> int | None:
    return None if seconds is None else bag.start + round(seconds * 1e9)


def _chosen(bag: Bag, topics: Collection[str] | None) -> list[Topic]:
    """The topics asked for, with or without their leading slash; all when none were."""
    if not topics:
        return list(bag.topics)
    wanted = {bare(name) for name in topics}
    kept = [topic for topic in bag.topics if bare(topic.name) in wanted]
    if missing := wanted - {bare(topic.name) for topic in kept}:
        have = ', '.join(topic.name for topic in bag.topics)
        raise BagError(f'Expected topics of {bag.path.name} ({have}), got {sorted(missing)[0]}.')
    return kept


def merge(sources: Sequence[Path], target: Path, storage: str = 'mcap') -> Written:
    """All messages of several bags in one, by their log times.

    Raises:
        BagError: a bag cannot be read, a topic has two types or a type two definitions, or the
            target exists.
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
        return Written(target, count, warnings + left_out, complete)


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
            numbers[-1][topic.name, topic.type, topic.schema] = number
            first = united.setdefault((topic.name, topic.type, number), topic)
            qos = first.qos + tuple(profile for profile in topic.qos if profile not in first.qos)
            described = first if first.definition else topic
            united[topic.name, topic.type, number] = replace(described, qos=qos, schema=number)
    return list(united.values()), numbers


def _renumbered(bag: Bag, numbers: Mapping[_TopicKey, int]) -> Iterator[Record]:
    """The records of a bag with the numbers of definitions that the new bag has."""
    for record in bag.records():
        number = numbers[record.topic, record.type, record.schema]
        yield record if number == record.schema else record._replace(schema=number)


def repair(source: Path, target: Path, storage: str = 'mcap') -> Written:
    """Everything that can be read of a bag, in a new one with index and metadata.yaml.

    Also what is in a chunk that was cut. `complete` is False when something that was once there
    could not be read; an end that was never written is no loss.

    Raises:
        BagError: nothing can be read, or the target exists.
    """
    with open_bag(source, thorough=True, salvage=True) as bag:
        count, left_out = _write(
            target, storage, bag.topics, bag.records(), bag.custom, bag.attachments
        )
        return Written(target, count, bag.warnings + left_out, bag.complete)


def needs_repair(source: Path) -> tuple[str, ...]:
    """What is wrong with a bag's files; () when there is nothing to mend."""
    with open_bag(source, thorough=True) as bag:
        for _ in bag.records():
            pass
        broken = not bag.complete or any(note.subject in _MENDED for note in bag.all_warnings)
        return bag.warnings if broken else ()


def _write(
    target: Path,
    storage: str,
    topics: Iterable[Topic],
    records: Iterable[Record],
    custom: Mapping[str, str],
    attachments: Iterable[Attachment],
) -> tuple[int, tuple[str, ...]]:
    """Write a bag; when that fails, what there is of it is taken away again.

    Returns the number of messages, and what was left out.
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
    except BaseException:
        shutil.rmtree(target, ignore_errors=True)
        raise
    return count, tuple(left_out)
