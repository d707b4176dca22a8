"""The decision log: one line of JSON for each demonstration, belief, decision and outcome.

Equal events give equal bytes: keys in the order of the messages' fields, times as integer
nanoseconds, numbers to nine significant digits (the last bits depend on the processor), NaN as
null. Neither the wall clock nor the machine is in it, nor the label of the world: bags from before
worlds have none, and a bag holds one world only, which its custom data names.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from typing import Any, NamedTuple

from likeme_core.observations import Demonstration
from likeme_core.stamps import stamp_ns
from likeme_inference.event_fields import belief_fields, decision_fields, outcome_fields
from likeme_inference.tabletop.values import Decision, GoalBelief, Outcome
from likeme_perception.demonstration_fields import demonstration_fields

SIGNIFICANT_DIGITS = 9


class LogEvent(StrEnum):
    """Events with a line in the log."""

    DEMONSTRATION = 'demonstration'
    BELIEF = 'belief'
    DECISION = 'decision'
    OUTCOME = 'outcome'


#: Topics of the events, with their types.
TOPICS: Mapping[str, tuple[LogEvent, str]] = {
    'demonstration': (LogEvent.DEMONSTRATION, 'likeme_msgs/msg/Demonstration'),
    'goal_belief': (LogEvent.BELIEF, 'likeme_msgs/msg/GoalBelief'),
    'decision': (LogEvent.DECISION, 'likeme_msgs/msg/Decision'),
    'outcome': (LogEvent.OUTCOME, 'likeme_msgs/msg/Outcome'),
}


class LogEntry(NamedTuple):
    """One event with the fields of its message; `stamp` in ns."""

    event: LogEvent
    stamp: int
    fields: Mapping[str, Any]

    @property
    def line(self) -> str:
        """The line of the log, without the newline."""
        values = {'event': self.event.value, 'stamp': self.stamp} | {
            name: _json_value(value) for name, value in self.fields.items()
        }
        return json.dumps(values, ensure_ascii=False, allow_nan=False)


def entry_of_event(event: Demonstration | GoalBelief | Decision | Outcome) -> LogEntry:
    """The entry of a value of perception or inference."""
    if isinstance(event, Demonstration):
        kind, fields = LogEvent.DEMONSTRATION, demonstration_fields(event)
    elif isinstance(event, GoalBelief):
        kind, fields = LogEvent.BELIEF, belief_fields(event)
    elif isinstance(event, Decision):
        kind, fields = LogEvent.DECISION, decision_fields(event)
    else:
        kind, fields = LogEvent.OUTCOME, outcome_fields(event)
    return LogEntry(kind, event.stamp, {'frame_id': event.frame} | fields)


def entry_of_message(event: LogEvent, message: Any, names: Iterable[str]) -> LogEntry:
    """The entry of a message (of any library) with these fields, but for the world's label."""
    fields = {name: getattr(message, name) for name in names if name not in ('header', 'world')}
    header = message.header
    return LogEntry(event, stamp_ns(header.stamp), {'frame_id': header.frame_id} | fields)


def in_order(entries: Iterable[LogEntry]) -> list[LogEntry]:
    """The entries of one input in the session's order: a belief before a decision."""
    return sorted(entries, key=lambda entry: list(LogEvent).index(entry.event))


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


def _json_value(value: Any) -> Any:
    """A field's value as JSON, whatever library it comes from."""
    if isinstance(value, float):
        return None if math.isnan(value) else float(f'{value:.{SIGNIFICANT_DIGITS}g}')
    for kind in (bool, int, str):
        # Members of enums as their plain values.
        if isinstance(value, kind):
            return kind(value)
    if hasattr(value, 'nanosec'):
        return stamp_ns(value)
    if hasattr(value, 'tolist'):
        return _json_value(value.tolist())
    if isinstance(value, Sequence) or hasattr(value, '__iter__'):
        return [_json_value(item) for item in value]
    raise TypeError(f'Expected a number, a text, a time or a list of them, got {value!r}.')
