"""Agreement of a replay's events with those that the bag recorded of its live run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from likeme_bags.reading import Bag
from likeme_replay.decision_log import TOPICS, LogEntry, LogEvent, entry_of_message
from likeme_replay.message_definitions import definitions


class EventAgreement(NamedTuple):
    """How many events of the live run the replay repeated, compared one by one."""

    event: LogEvent
    same: int
    live: int
    replayed: int

    @property
    def whole(self) -> bool:
        """Whether nothing differs."""
        return self.same == self.live == self.replayed

    @property
    def sentence(self) -> str:
        """The agreement in words."""
        return f'{self.same} of {self.live} {self.event.value}s as in the live run'


def recorded_entries(bag: Bag) -> list[LogEntry]:
    """The events in a bag's topics, in the order of their log times.

    Messages of other types, and bytes that do not fit the type, are left out.
    """
    names = {t.name: t.name.lstrip('/') for t in bag.topics}
    wanted = [t.name for t in bag.topics if TOPICS.get(names[t.name], ('', ''))[1] == t.type]
    entries = []
    for record in bag.records(wanted):
        event, kind = TOPICS[names[record.topic]]
        if record.type != kind:
            continue
        definitions().load(kind)
        fields = [name for name, _ in definitions().store.fielddefs[kind][1]]
        try:
            message = definitions().read(record.data, kind)
        except ValueError:
            continue
        entries.append(entry_of_message(event, message, fields))
    return entries


def compare(live: Sequence[LogEntry], replayed: Sequence[LogEntry]) -> list[EventAgreement]:
    """Compare both logs for each kind of event that the live run had."""
    found = []
    for event in LogEvent:
        expected = [e.line for e in live if e.event is event]
        got = [e.line for e in replayed if e.event is event]
        same = sum(a == b for a, b in zip(expected, got, strict=False))
        if expected:
            found.append(EventAgreement(event, same, len(expected), len(got)))
    return found
