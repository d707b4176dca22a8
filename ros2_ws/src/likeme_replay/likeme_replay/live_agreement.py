"""What a recording of a live run says it came to, beside what its replay came to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from likeme_bags.reading import Bag
from likeme_replay.decision_log import TOPICS, Entry, Event, entry_of
from likeme_replay.message_definitions import definitions


class Agreement(NamedTuple):
    """How many of the live run's events the replay came to in the same words, one by one."""

    event: Event
    same: int
    live: int
    replayed: int

    @property
    def whole(self) -> bool:
        """Whether nothing differs."""
        return self.same == self.live == self.replayed

    @property
    def sentence(self) -> str:
        """It in words."""
        return f'{self.same} of {self.live} {self.event.value}s as in the live run'


def recorded_entries(bag: Bag) -> list[Entry]:
    """The events among a bag's topics, in the order of their log times."""
    names = {t.name: t.name.lstrip('/') for t in bag.topics if t.name.lstrip('/') in TOPICS}
    entries = []
    for record in bag.records(list(names)):
        event, kind = TOPICS[names[record.topic]]
        definitions().know(kind)
        fields = [name for name, _ in definitions().store.fielddefs[kind][1]]
        entries.append(entry_of(event, definitions().read(record.data, kind), fields))
    return entries


def compare(live: Sequence[Entry], replayed: Sequence[Entry]) -> list[Agreement]:
    """Hold the two against each other, for each event the live run had."""
    found = []
    for event in Event:
        there = [e.line for e in live if e.event is event]
        here = [e.line for e in replayed if e.event is event]
        same = sum(a == b for a, b in zip(there, here, strict=False))
        if there:
            found.append(Agreement(event, same, len(there), len(here)))
    return found
