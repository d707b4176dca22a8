"""Recordings of other cameras: topics renamed, types converted, so that the cell knows them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from likeme_bags.adapting import Adaptation, camera_remap
from likeme_bags.reading import Bag
from likeme_bags.values import Record
from likeme_replay.recorded_inputs import FRAME_DONE, HEARD, NEEDED, Source

ReadSource = Callable[[Bag, int | None, int | None], Source]


def pairs(given: Sequence[str], option: str) -> dict[str, str]:
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


def adapted(remap: Mapping[str, str], types: Mapping[str, str]) -> ReadSource:
    """How `Script` reads any bag: the known names of other drivers are found by themselves.

    The source raises BagError for what cannot be used, with the topic, expected and got.
    """

    def source(bag: Bag, start: int | None = None, end: int | None = None) -> Source:
        # With types of one's own only the names that were given count.
        names = dict(remap) if types else camera_remap(bag, remap)
        adaptation = Adaptation(names, types)
        topics = adaptation.topics(bag)
        wanted = {*NEEDED, FRAME_DONE, HEARD}
        chosen = [
            old.name
            for old, new in zip(bag.topics, topics, strict=True)
            if new.name.lstrip('/') in wanted
        ]

        def records() -> Iterator[Record]:
            for record in adaptation.records(bag, chosen, start, end):
                yield record._replace(topic=record.topic.lstrip('/'))

        return Source(str(bag.path), {t.name.lstrip('/'): t.type for t in topics}, records())

    return source
