"""Writes what a session takes in and does into the decision log, before anything follows from it.

    log = SessionLog(DecisionLog(place), world, cell='robot/0/inference_node', run=run)
    restored = restore(log)                       # see session_restore.py
    events = apply_input(session, value)
    log.record(value, events, session, before)    # StoreError: nothing may follow from it

An entry's text is JSON. All have `cell` and `world`, the label; further by kind:

    started                   node, names (decision_record.world_record), parameters, restored
    demonstration, belief     the fields of Demonstration and of GoalBelief
    joint_belief              see joint_belief.belief_record; after each attempt, and at the stop
    table_goal                the joint goal of a person who has stopped
    decision                  decision_record.decision_record
    question, answer          HelpRequest; request, reply, answered_by
    motion_requested          id, decision, object, action, expires
    motion_report             how the session was told that the motion ended
    outcome                   the fields of Outcome
    remark                    sentence
    parameters                those that were changed
    session                   state: see session_restore.py
    hold, resume, motion      what the cell reported, by whomever it was caused
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from likeme_core.observations import Demonstration
from likeme_core.world import World
from likeme_inference.decision_record import decision_record, world_record
from likeme_inference.experience.store_error import StoreError
from likeme_inference.help_requests import AcceptedAnswer
from likeme_inference.joint_belief import JointBelief, belief_record
from likeme_inference.session_inputs import InputValue, SessionEvent
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import help_request
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import SessionState
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    MotionReport,
    Outcome,
    TableGoal,
)
from likeme_inference.value_json import to_json, to_text

if TYPE_CHECKING:
    from likeme_inference.experience.decision_log import DecisionLog

#: s after a failed attempt in which no other is made: each may block the node for a while.
RETRY_PERIOD = 1.0
#: Reports of the cell that wait for being written while the log cannot be.
NOTES_KEPT = 1000
#: Fields of a session that are not kept with it: the decision has an entry of its own, and the
#: next table states bring the others.
ELSEWHERE: dict[str, Any] = {
    'decision': None,
    'latest': None,
    'off_goal_since': None,
    'resumed_at': 0,
}

Row = tuple[str, Mapping[str, Any]]


class SessionLog:
    """The log of one node's session; without a DecisionLog everything is accepted and forgotten.

    Attributes:
        log: where it is written; None: nowhere.
        cell: whose session it is, as several may write into one log.
        run: of this process.
        problem: why it cannot be written at present, in one sentence; empty: it can.
        paused: whether nothing is written, as while a recording is replayed.
        decided: the record of the newest decision, written or not; None: none yet.
    """

    def __init__(
        self, log: DecisionLog | None, world: World, cell: str, run: str,
        now: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        """now: monotonic clock, s."""
        self.log, self.world, self.cell, self.run = log, world, cell, run
        self.problem = ''
        self.paused = False
        self.decided: Mapping[str, Any] | None = None
        self._now = now
        self._again = 0.0
        self._notes: list[Row] = []

    @property
    def place(self) -> str:
        """Where it is; empty: nowhere."""
        return '' if self.log is None else self.log.place

    def write(self, *rows: Row) -> None:
        """Write entries, all or none, after those that wait.

        Raises:
            StoreError: they are not written, and nothing may follow from them.
        """
        waiting = [*self._notes, *rows]
        if self.log is None or self.paused or not waiting:
            return
        if self.problem and self._now() < self._again:
            raise StoreError(self.problem)
        try:
            whose = {'cell': self.cell, 'world': self.world.label}
            texts = [(kind, to_text({**data, **whose})) for kind, data in waiting]
            self.log.append(self.run, texts)
        except StoreError as error:
            if not self.problem:
                gap = f'From here on the log could not be written for a while: {error}'
                self._notes.append(('remark', {'sentence': gap}))
            self.problem, self._again = str(error), self._now() + RETRY_PERIOD
            raise
        self.problem = ''
        self._notes.clear()

    def note(self, kind: str, data: Mapping[str, Any]) -> None:
        """Write what happened without this node's doing, now or as soon as it can be written."""
        if self.log is None:
            return
        self._notes = [*self._notes, (kind, data)][-NOTES_KEPT:]
        self.poll()

    def poll(self) -> None:
        """Write what waits."""
        try:
            self.write()
        except StoreError:
            return

    def started(self, node: str, parameters: Mapping[str, Any], restored: str) -> None:
        """Note the start of the process and how it was restored."""
        names = world_record(self.world)
        told = {'node': node, 'names': names, 'parameters': parameters, 'restored': restored}
        self.note('started', told)

    def record(
        self, value: InputValue, events: list[SessionEvent], session: ImitationSession,
        before: SessionState, answer: AcceptedAnswer | None = None,
    ) -> None:  # fmt: skip
        """Write an input that the session took in, its events, and the state it is in now.

        before: the state it was in. answer: that was accepted, if the input is one.

        Raises:
            StoreError: see `write`.
        """
        rows = [*_input_rows(value, session, answer)]
        for event in events:
            rows += _event_rows(event, session, value)
        if session.state.differs(before):
            rows.append(self._state_row(session.state))
        if rows:
            self.write(*rows)
        self.decided = next((data for kind, data in rows if kind == 'decision'), self.decided)

    def believed(self, belief: JointBelief) -> None:
        """Note a joint belief; it is written before what follows from it, or that is refused.

        Not while a recording is replayed: notes wait until its end, and this one is not of the
        cell.
        """
        if not self.paused:
            self.note('joint_belief', belief_record(belief, self.world))

    def request_motion(self, decision: Decision, motion_id: str, expires: int) -> None:
        """Write that the arm is about to be asked; expires in ns.

        Raises:
            StoreError: see `write`.
        """
        assert decision.action is not None, 'Only actions are executed.'
        names = {'object': decision.object, 'action': decision.action.name}
        request = {'id': motion_id, 'decision': decision.id, 'expires': expires}
        self.write(('motion_requested', {**request, **names}))

    def note_state(self, state: SessionState) -> None:
        """Note the state of a session that begins."""
        self.note(*self._state_row(state))

    def _state_row(self, state: SessionState) -> Row:
        return 'session', {'state': _kept_state(state)}


def _kept_state(state: SessionState) -> dict[str, Any]:
    """What is written of a state; its decision by number, as it has an entry of its own."""
    kept: dict[str, Any] = to_json(replace(state, suspended=(), **ELSEWHERE))
    kept['decision'] = None if state.decision is None else state.decision.id
    kept['suspended'] = [_kept_state(each) for each in state.suspended]
    return kept


def _input_rows(
    value: InputValue, session: ImitationSession, answer: AcceptedAnswer | None
) -> list[Row]:
    if isinstance(value, Demonstration):
        return [('demonstration', to_json(value))]
    if isinstance(value, TableGoal):
        return [('table_goal', to_json(value))]
    if isinstance(value, MotionReport):
        decision = session.decision
        return [
            ('motion_report', {**to_json(value), 'decision': decision.id if decision else None})
        ]
    return [] if answer is None else [('answer', to_json(answer))]


def _event_rows(event: SessionEvent, session: ImitationSession, value: InputValue) -> list[Row]:
    if isinstance(event, GoalBelief):
        return [('belief', to_json(event))]
    if isinstance(event, Outcome):
        return [('outcome', to_json(event))]
    if not isinstance(event, Decision):
        return [('remark', to_json(event))]
    # An object without trials leads to a decision, but not to a demonstration to imitate.
    shown = value if isinstance(value, Demonstration) else None
    if shown is not None and shown.stamp != event.demonstration:
        shown = None
    rows: list[Row] = [('decision', decision_record(session, event, shown))]
    if event.kind is Kind.ASK_HUMAN:
        rows.append(('question', to_json(help_request(event))))
    return rows
