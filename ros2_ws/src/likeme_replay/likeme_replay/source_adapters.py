"""Recordings of other cameras: topics renamed and types converted to those of the cell."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from likeme_bags.adapting import Adaptation
from likeme_bags.camera_topics import camera_remap
from likeme_bags.reading import Bag
from likeme_bags.values import Record
from likeme_replay.recorded_inputs import CAMERA_TOPICS, REPLAY_TOPICS, RecordSource

ReadSource = Callable[[Bag, int | None, int | None], RecordSource]


def parse_pairs(given: Sequence[str], option: str) -> dict[str, str]:
    """'FROM:=TO' texts as a mapping.

    Raises:
        ValueError: one is not of that form, or a FROM comes twice.
    """
    found: dict[str, str] = {}
    for text in given:
        old, arrow, new = text.partition(':=')
        if not (old and arrow and new):
            raise ValueError(f'Expected {option} FROM:=TO, got {text!r}.')
        if old in found:
            raise ValueError(f'Expected each FROM of {option} once, got {old!r} twice.')
        found[old] = new
    return found


def adapted_source(remap: Mapping[str, str], types: Mapping[str, str]) -> ReadSource:
    """How a replay reads any bag: topic names of known drivers are found automatically.

    The source raises BagError for what cannot be used, with the topic, expected and got.
    """

    def source(bag: Bag, start: int | None = None, end: int | None = None) -> RecordSource:
        # With --type-map only the names that were given count.
        names = dict(remap) if types else camera_remap(bag, remap)
        adaptation = Adaptation(names, types)
        chosen, found, recorded = [], {}, {}
        for old, new in zip(bag.topics, adaptation.topics(bag), strict=True):
            name = new.name.lstrip('/')
            if REPLAY_TOPICS.get(name) == new.type:
                found[name] = new.type
                chosen.append(old.name)
                if name not in CAMERA_TOPICS and old.type == new.type:
                    recorded[name] = old
            elif name in CAMERA_TOPICS:
                # For the error sentence, unless another topic of this name has the right type.
                found.setdefault(name, new.type)

        def records() -> Iterator[Record]:
            for record in adaptation.records(bag, chosen, start, end):
                yield record._replace(topic=record.topic.lstrip('/'))

        return RecordSource(str(bag.path), found, records(), recorded)

    return source
