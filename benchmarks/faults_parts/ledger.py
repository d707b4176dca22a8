"""What was published and accepted, against what the decision log holds in the end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from likeme_inference.experience.decision_log import DecisionLog
from likeme_replay.policies.motion_ids import decision_of

#: Names of states in the log's entries `motion`.
STATES = {1: 'UNDER_WAY', 2: 'ENDED'}
Key = tuple[str, Any]


class Ledger:
    """Keys of everything that must be in the log.

    Attributes:
        early: decisions and outcomes that were published before they were in the log.
    """

    def __init__(self) -> None:
        self._expected: dict[Key, None] = {}
        self._written: set[Key] = set()
        self.early: list[Key] = []

    def observe(self, topic: str, message: Any) -> None:
        """A message was published."""
        for key in _keys_of_message(topic, message):
            self._expected[key] = None
            if topic in ('decision', 'outcome', 'goal_belief') and key not in self._written:
                self.early.append(key)

    def answered(self, request_id: int, reply: int) -> None:
        """The service accepted an answer."""
        self._expected['answer', (request_id, reply)] = None

    def written(self, kind: str, data: Mapping[str, Any]) -> None:
        """An entry was written."""
        self._written.update(_keys_of_entry(kind, data))

    def lost(self, log: DecisionLog) -> list[Key]:
        """What was to be in the log, and is not."""
        there: set[Key] = set()
        for entry in log.entries():
            there.update(_keys_of_entry(entry.kind, entry.data))
        return [key for key in self._expected if not there.intersection((key, *_instead(key)))]


def _instead(key: Key) -> list[Key]:
    """What says the same: of a motion its end, and how its end was told to the session.

    The reports of a driver that is killed in the same moment as the inference node reach nobody.
    """
    kind, what = key
    if kind != 'motion':
        return []
    return [(kind, (what[0], 'ENDED')), ('motion_report', decision_of(what[0]))]


def _keys_of_message(topic: str, message: Any) -> list[Key]:
    if topic == 'decision':
        asks = [('question', int(message.id))] if message.kind == 1 else []
        return [('decision', int(message.id)), *asks]
    if topic == 'outcome':
        return [('outcome', int(message.decision_id))]
    if topic == 'goal_belief':
        stamp = message.header.stamp
        return [('belief', (stamp.sec * 1_000_000_000 + stamp.nanosec, message.object))]
    if topic == 'motion':
        return [('motion', (message.id, STATES[message.state]))]
    if topic == 'cell/holds':
        return [('hold' if message.held else 'resume', int(message.change))]
    return []


def _keys_of_entry(kind: str, data: Mapping[str, Any]) -> list[Key]:
    if kind == 'decision':
        return [(kind, data['decision']['id'])]
    if kind == 'motion_report':
        return [(kind, data['decision'])]
    if kind == 'question':
        return [(kind, data['id'])]
    if kind == 'outcome':
        return [(kind, data['decision_id'])]
    if kind == 'belief':
        return [(kind, (data['stamp'], data['object']))]
    if kind == 'motion':
        return [(kind, (data['id'], data['state']))]
    if kind in ('hold', 'resume'):
        return [(kind, data['change'])]
    if kind == 'answer':
        replies = {'DONE_BY_HAND': 0, 'TRY_ANYWAY': 1, 'SKIP': 2, 'NAME_GOAL': 3}
        return [(kind, (data['request']['id'], replies[data['reply']]))]
    return []
