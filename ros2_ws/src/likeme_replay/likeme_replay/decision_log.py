"""The decision log: one line of JSON for each demonstration, belief, decision and outcome.

The same events give the same bytes: keys in the order of the messages' fields, times as integer
nanoseconds, numbers to nine significant digits (so that the last bits of another processor's
arithmetic do not show), NaN as null. Nothing of the wall clock or of a machine is in it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from typing import Any, NamedTuple

DIGITS = 9


class Event(StrEnum):
    """What has a line."""

    DEMONSTRATION = 'demonstration'
    BELIEF = 'belief'
    DECISION = 'decision'
    OUTCOME = 'outcome'


#: Topic and type of each event, and the fields that are times.
TOPICS: Mapping[str, tuple[Event, str]] = {
    'demonstration': (Event.DEMONSTRATION, 'likeme_msgs/msg/Demonstration'),
    'goal_belief': (Event.BELIEF, 'likeme_msgs/msg/GoalBelief'),
    'decision': (Event.DECISION, 'likeme_msgs/msg/Decision'),
    'outcome': (Event.OUTCOME, 'likeme_msgs/msg/Outcome'),
}


class Entry(NamedTuple):
    """One event with the fields of its message; `stamp` in ns."""

    event: Event
    stamp: int
    fields: Mapping[str, Any]

    @property
    def line(self) -> str:
        """Its line of the log, without the newline."""
        values = {'event': self.event.value, 'stamp': self.stamp} | {
            name: _plain(value) for name, value in self.fields.items()
        }
        return json.dumps(values, ensure_ascii=False, allow_nan=False)


def entry_of(event: Event, message: Any, names: Iterable[str]) -> Entry:
    """The entry of a message (of any library) with these fields, `header` first."""
    fields = {name: getattr(message, name) for name in names if name != 'header'}
    header = message.header
    return Entry(event, _nanoseconds(header.stamp), {'frame_id': header.frame_id} | fields)


def in_order(entries: Iterable[Entry]) -> list[Entry]:
    """What one input led to, as the session comes to it: a belief before a decision."""
    return sorted(entries, key=lambda entry: list(Event).index(entry.event))


def read_log(text: str) -> Iterator[dict[str, Any]]:
    """The lines of a log as values.

    Raises:
        ValueError: a line is no JSON object with an event and a stamp.
    """
    for number, line in enumerate(text.splitlines(), 1):
        value = json.loads(line)
        if not isinstance(value, dict) or not {'event', 'stamp'} <= value.keys():
            raise ValueError(
                f'Expected an event with a stamp in line {number}, got {line[:60]!r}.'
            )
        yield value


def _plain(value: Any) -> Any:
    """A field's value as JSON that does not depend on where it comes from."""
    if isinstance(value, float):
        return None if math.isnan(value) else float(f'{value:.{DIGITS}g}')
    for kind in (bool, int, str):
        # Enums as what they stand for.
        if isinstance(value, kind):
            return kind(value)
    if hasattr(value, 'nanosec'):
        return _nanoseconds(value)
    if hasattr(value, 'tolist'):
        return _plain(value.tolist())
    if isinstance(value, Sequence) or hasattr(value, '__iter__'):
        return [_plain(item) for item in value]
    raise TypeError(f'Expected a number, a text, a time or a list of them, got {value!r}.')


def _nanoseconds(stamp: Any) -> int:
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
