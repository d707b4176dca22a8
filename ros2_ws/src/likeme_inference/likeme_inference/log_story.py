"""Entries of the decision log as lines for people, and the story of one decision."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Any

from likeme_inference.decision_record import recorded_world, rederive
from likeme_inference.experience.decision_log import DecisionLog, LogEntry
from likeme_inference.experience.store_error import StoreError

#: Kinds that belong to the decision of the number in this field.
NUMBER_OF = {
    'decision': ('decision', 'id'),
    'question': ('id',),
    'answer': ('request', 'id'),
    'motion_requested': ('decision',),
    'motion_report': ('decision',),
    'outcome': ('decision_id',),
}


def line(entry: LogEntry) -> str:
    """An entry on one line: number, time, kind, what happened."""
    return f'{entry.number:6}  {_clock(entry.time)}  {entry.kind:16}  {sentence(entry)}'


def sentence(entry: LogEntry) -> str:
    """What happened, in one sentence; damaged entries show their text."""
    try:
        return _SENTENCES.get(entry.kind, _fields)(entry.data)
    except (StoreError, KeyError, TypeError, ValueError):
        return str(entry.text)


def _clock(nanoseconds: Any) -> str:
    try:
        return datetime.fromtimestamp(nanoseconds / 1e9).isoformat(' ', 'milliseconds')
    except (TypeError, ValueError, OverflowError, OSError):
        return str(nanoseconds)


def _fields(data: Any) -> str:
    own = {key: value for key, value in data.items() if key not in ('cell', 'world')}
    return ', '.join(f'{key} {value}' for key, value in own.items())


def _demonstration(data: Any) -> str:
    return f'{data["object"]} from {data["x_i"]} to {data["x_f"]} by {data["manner"]}'


def _joint_belief(data: Any) -> str:
    return f'{data["sentence"]} {data["events"]} events, p-value {data["p_value"]:.2g}'


def _motion(data: Any) -> str:
    ended = f' {data["outcome"]}: {data["message"]}' if data['outcome'] else ''
    return f'{data["actor"]}: {data["action"]} {data["object"]} {data["state"]}{ended}'


def _answer(data: Any) -> str:
    named = f' {data["goal"]}' if data.get('goal') else ''
    return f'{data["request"]["id"]}: {data["reply"]}{named} by {data["answered_by"]}'


def _session(data: Any) -> str:
    state = data['state']
    about = f', decision {state["decision"]}' if state['decision'] else ''
    return f'{state["phase"]}{about}'


_SENTENCES = {
    'started': lambda d: f'{d["node"]} in {d["world"]}. {d["restored"]}'.strip(),
    'demonstration': _demonstration,
    'belief': lambda d: str(d['sentence']),
    'joint_belief': _joint_belief,
    'table_goal': lambda d: str(d['sentence']),
    'decision': lambda d: f'{d["decision"]["id"]}: {d["decision"]["sentence"]}',
    'question': lambda d: f'{d["id"]}: {d["question"]}',
    'answer': _answer,
    'motion_requested': lambda d: f'{d["action"]} {d["object"]} for decision {d["decision"]}',
    'motion_report': lambda d: f'{d["outcome"] or "no outcome"}: {d["message"]}',
    'motion': _motion,
    'hold': lambda d: f'by {d["by"] or "?"}: {d["reason"]}',
    'resume': lambda d: f'by {d["by"] or "?"}: {d["reason"]}',
    'outcome': lambda d: f'{d["result"]}: {d["sentence"]}',
    'remark': lambda d: str(d['sentence']),
    'session': _session,
}


class DecisionStory:
    """One decision with all that led to it and followed from it."""

    def __init__(self, log: DecisionLog, number: int) -> None:
        """Find the newest decision of a number.

        Raises:
            StoreError: there is none, or the log cannot be read.
        """
        found = log.newest('decision', f'"id":{number},')
        if found is None or found.data['decision']['id'] != number:
            last = log.newest('decision')
            known = f'up to {last.data["decision"]["id"]}' if last else 'none yet'
            raise StoreError(f'Expected the number of a decision ({known}), got {number}.')
        self._log, self.decision, self.number = log, found, number
        self._cell = found.data['cell']

    def lines(self) -> list[str]:
        """The story, an entry a line."""
        return [line(entry) for entry in self.entries()]

    def entries(self) -> list[LogEntry]:
        """Demonstration, beliefs, decision, question, answer, motion and outcome."""
        seen = ('demonstration', 'belief', 'joint_belief', 'table_goal')
        wanted = (*seen, *NUMBER_OF, 'motion')
        own = [e for e in self._log.entries(wanted) if self._belongs_to_the_cell(e)]
        before = [e for e in own if e.number < self.decision.number]
        stamp = self.decision.data['decision']['demonstration']
        shown = [e for e in before if e.kind == 'demonstration' and e.data['stamp'] == stamp][-1:]
        believed = [e for e in before if e.kind == 'belief' and e.data['stamp'] == stamp][-1:]
        joint = (e for e in before if e.kind == 'table_goal')
        goals = [e for e in joint if e.data['demonstration'] == stamp][-1:]
        for goal in goals:
            believed += _on_the_way(before, goal)
        believed += goals
        after = [e for e in own if e.number >= self.decision.number]
        mine = list(_until_next(after, self.number))
        ids = {e.data['id'] for e in mine if e.kind == 'motion_requested'}
        moved = [e for e in after if e.kind == 'motion' and e.data['id'] in ids]
        return sorted([*shown, *believed, *mine, *moved])

    def differences(self) -> list[str]:
        """What does not follow from the record of the decision; empty: it was made again, alike.

        Raises:
            StoreError: the record is incomplete.
        """
        try:
            names = names_of(self._log, self.decision.data['world'])
            return rederive(self.decision.data, recorded_world(names))
        except (KeyError, ValueError, TypeError) as error:
            raise StoreError(
                f'Entry {self.decision.number}: expected the full record of a decision, got: '
                f'{type(error).__name__} {error}.'
            ) from error

    def _belongs_to_the_cell(self, entry: LogEntry) -> bool:
        return bool(entry.data.get('cell') == self._cell)


def names_of(log: DecisionLog, label: str) -> Any:
    """What the names of a world mean, see decision_record.world_record.

    Raises:
        StoreError: no entry tells.
    """
    for entry in log.entries(['started'], 1, f'"label":"{label}"'):
        return entry.data['names']
    raise StoreError(f'Expected an entry with the names of the world {label}, got none.')


def _on_the_way(before: Sequence[LogEntry], goal: LogEntry) -> list[LogEntry]:
    """The joint beliefs of the demonstration of a joint goal."""
    found: list[LogEntry] = []
    for entry in before:
        if entry.kind != 'joint_belief' or entry.number > goal.number:
            continue
        if entry.data['demonstration'] == goal.data['demonstration']:
            # One that has ended, and has the stamp as a clock began anew, is another.
            if found and found[-1].data['stopped']:
                found.clear()
            found.append(entry)
    return found


def _until_next(entries: Sequence[LogEntry], number: int) -> Iterable[LogEntry]:
    """Entries about a decision, up to another decision of the same number."""
    for entry in entries:
        if entry.kind in NUMBER_OF and _number(entry) == number:
            if entry.kind == 'decision' and entry is not entries[0]:
                return
            yield entry


def _number(entry: LogEntry) -> Any:
    value = entry.data
    for key in NUMBER_OF[entry.kind]:
        value = value[key]
    return value
