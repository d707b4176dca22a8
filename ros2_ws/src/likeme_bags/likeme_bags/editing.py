"""New bags from old ones: a part, several in one, a mended one. Originals stay as they are."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from heapq import merge as merged_by
from pathlib import Path
from typing import NamedTuple

from likeme_bags.adapting import bare
from likeme_bags.bag_warnings import About
from likeme_bags.errors import BagError
from likeme_bags.reading import Bag, open_bag
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

# What repair writes anew; what is said of topics and QoS it keeps.
_MENDED = (About.FILES, About.METADATA, About.INDEX)


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
        count = _write(target, storage, kept, bag.records(names, first, last), bag.custom)
        return Written(target, count, bag.warnings, bag.complete)


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
        topics = _united([topic for bag in bags for topic in bag.topics])
        records = merged_by(*(bag.records() for bag in bags), key=lambda record: record.stamp)
        custom = {key: value for bag in bags for key, value in bag.custom.items()}
        count = _write(target, storage, topics, records, custom)
        warnings = tuple(f'{b.path.name}: {w}' for b in bags for w in b.warnings)
        return Written(target, count, warnings, all(bag.complete for bag in bags))


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


def repair(source: Path, target: Path, storage: str = 'mcap') -> Written:
    """Everything that can be read of a bag, in a new one with index and metadata.yaml.

    Also what is in a chunk that was cut. `complete` is False when something that was once there
    could not be read; an end that was never written is no loss.

    Raises:
        BagError: nothing can be read, or the target exists.
    """
    with open_bag(source, thorough=True, salvage=True) as bag:
        count = _write(target, storage, bag.topics, bag.records(), bag.custom)
        return Written(target, count, bag.warnings, bag.complete)


def needs_repair(source: Path) -> tuple[str, ...]:
    """What is wrong with a bag's files; () when there is nothing to mend."""
    with open_bag(source, thorough=True) as bag:
        for _ in bag.records():
            pass
        broken = not bag.complete or any(note.about in _MENDED for note in bag.notes)
        return bag.warnings if broken else ()


def _write(
    target: Path,
    storage: str,
    topics: Iterable[Topic],
    records: Iterable[Record],
    custom: Mapping[str, str],
) -> int:
    """Write a bag; when that fails, what there is of it is taken away again."""
    writer = BagWriter(target, storage, custom=custom)
    count = 0
    try:
        with writer:
            for topic in topics:
                writer.add(topic)
            for record in records:
                writer.write(record)
                count += 1
    except BaseException:
        shutil.rmtree(target, ignore_errors=True)
        raise
    return count
