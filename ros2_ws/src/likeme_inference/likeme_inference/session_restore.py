"""Takes a session up where the decision log says that it was."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar

from likeme_core.world import World
from likeme_inference.help_requests import ANSWERS_KEPT, AcceptedAnswer
from likeme_inference.joint_belief import ToldEvent, told_events
from likeme_inference.session_log import ELSEWHERE, SessionLog
from likeme_inference.tabletop.promise import WINDOW
from likeme_inference.tabletop.session_state import Phase, SessionState
from likeme_inference.tabletop.values import Decision, GoalBelief, Outcome
from likeme_inference.value_json import from_json, to_text

if TYPE_CHECKING:
    from likeme_inference.experience.decision_log import DecisionLog, LogEntry

T = TypeVar('T')
#: Events of a demonstration that are taken up; of a longer one, none.
EVENTS_KEPT = 256
#: What is open in these phases.
OPEN = {
    Phase.TURN: 'the turn that follows the demonstration of {demonstration}',
    Phase.ASKING: 'the question about {decision}',
    Phase.ACTING: 'the motion of {decision}',
    Phase.CONFIRMING: 'the look at how {decision} ended',
}


@dataclass(frozen=True)
class Restored:
    """What a node takes up.

    Attributes:
        state: of the session, with its last decision.
        belief, outcome: the last ones, if they are of this world.
        decided: the decision that `outcome` ended.
        motion: id of the request of the decision under way; empty: the arm was not asked yet.
        answers: the last ones.
        outcomes: the latest, oldest first, as many as calibration looks back to.
        events: of the newest demonstration of joint goals.
        newest: decision, that of the state or a later one that was answered before it.
        record: of it, see decision_record; None: there is no decision.
        sentence: what is restored; empty: nothing.
    """

    state: SessionState = field(default_factory=SessionState)
    belief: GoalBelief | None = None
    outcome: Outcome | None = None
    decided: Decision | None = None
    motion: str = ''
    answers: tuple[AcceptedAnswer, ...] = ()
    outcomes: tuple[Outcome, ...] = ()
    events: tuple[ToldEvent, ...] = ()
    newest: Decision | None = None
    record: Mapping[str, Any] | None = None
    sentence: str = ''


def restore(log: SessionLog) -> Restored:
    """Read what the node's last run left.

    Raises:
        StoreError: the log cannot be read, or an entry that is needed is not what was written.
    """
    if log.log is None:
        return Restored()
    there = _Reader(log.log, log.world, f'"cell":{to_text(log.cell)}')
    entry, decisions = there.entry('session'), there.last_decision()
    if entry is None:
        return Restored(SessionState(decisions=decisions))
    known = entry.data
    if known['world'] != log.world.label:
        why = f'was last written in the world {known["world"]}; this is {log.world.label}'
    else:
        try:
            return _taken_up(there, known['state'], decisions)
        except (KeyError, ValueError, TypeError) as error:
            why = f'has no session to take up in entry {entry.number}: {error}'
    sentence = f'The decision log {log.place} {why}. A new session begins.'
    return Restored(SessionState(decisions=decisions), sentence=sentence)


class _Reader:
    """Reads the entries of one cell."""

    def __init__(self, log: DecisionLog, world: World, own: str) -> None:
        self.place = log.place
        self._log, self._world, self._own = log, world, own

    def entry(self, kind: str, *holding: str) -> LogEntry | None:
        return self._log.newest(kind, self._own, *holding)

    def value(self, kind: str, of: type[T]) -> T | None:
        """The newest one of a kind, if it is of this world."""
        entry = self.entry(kind)
        return None if entry is None else self._read(entry, of)

    def last_decision(self) -> int:
        entry = self.entry('decision')
        return 0 if entry is None else int(entry.data['decision']['id'])

    def decision(self, number: int | None) -> Decision | None:
        """The decision of a number.

        Raises:
            ValueError: there is none.
        """
        record = self.record(number)
        return None if record is None else from_json(Decision, record['decision'], self._world)

    def record(self, number: int | None) -> Any:
        """The record of the decision of a number.

        Raises:
            ValueError: there is none.
        """
        if number is None:
            return None
        entry = self.entry('decision', f'"id":{number},')
        if entry is None or entry.data['decision']['id'] != number:
            raise ValueError(f'decision {number} is not there')
        return entry.data

    def state(self, kept: Mapping[str, Any]) -> SessionState:
        given = {**kept, **ELSEWHERE, 'suspended': []}
        if given.get('promise') is not None:
            # An older log says whether a goal was reached, not how probably.
            recent = [float(each) for each in given['promise']['recent']]
            given['promise'] = {**given['promise'], 'recent': recent}
        plain = from_json(SessionState, given, self._world)
        # A log that was written before questions could be suspended has none.
        suspended = tuple(self.state(each) for each in kept.get('suspended', ()))
        # A timeout counts from the first table state on.
        decision = self.decision(kept['decision'])
        return replace(plain, decision=decision, suspended=suspended, resumed_at=None)

    def motion(self, decision: Decision) -> str:
        """Id of the request that was made for a decision; empty: none was."""
        entry = self.entry('motion_requested')
        if entry is None or entry.data['decision'] != decision.id:
            return ''
        return str(entry.data['id'])

    def latest(self, kind: str, of: type[T], count: int) -> tuple[T, ...]:
        """The newest ones of a kind that are of this world, oldest first."""
        entries = self._log.entries([kind], count, self._own)
        read = (self._read(entry, of) for entry in entries)
        return tuple(value for value in read if value is not None)

    def events(self) -> tuple[ToldEvent, ...]:
        entries = self._log.entries(['joint_belief'], EVENTS_KEPT, self._own)
        records = [entry.data for entry in entries]
        own = [record for record in records if record['world'] == self._world.label]
        return told_events(own, self._world)

    def _read(self, entry: LogEntry, of: type[T]) -> T | None:
        data = entry.data
        if data.pop('world') != self._world.label:
            return None
        del data['cell']
        return from_json(of, data, self._world)


def _taken_up(there: _Reader, kept: Mapping[str, Any], decisions: int) -> Restored:
    state = replace(there.state(kept), decisions=decisions)
    acting = state.decision if state.phase is Phase.ACTING else None
    outcome = there.value('outcome', Outcome)
    return Restored(
        state,
        there.value('belief', GoalBelief),
        outcome,
        there.decision(outcome.decision_id) if outcome else None,
        there.motion(acting) if acting else '',
        there.latest('answer', AcceptedAnswer, ANSWERS_KEPT),
        there.latest('outcome', Outcome, WINDOW),
        there.events(),
        there.decision(decisions or None),
        there.record(decisions or None),
        _sentence(there.place, state),
    )


def _sentence(place: str, state: SessionState) -> str:
    waiting = [f'{each.object} ({each.id})' for each in state.questions if each != state.decision]
    also = f' Open questions: {", ".join(waiting)}.' if waiting else ''
    if state.phase not in OPEN:
        return f'Restored from {place}: nothing was under way.{also}'
    decision, demo = state.decision, state.demonstration
    what = OPEN[state.phase].format(
        decision=f'decision {decision.id} on {decision.object}' if decision else '',
        demonstration=demo.object if demo else '',
    )
    return f'Restored from {place}: {what} goes on ({state.phase.name}).{also}'
