"""Policies of outcomes, and that every decision gets one."""

from __future__ import annotations

import math
from typing import Any

from likeme_core.stamps import stamp_ns
from likeme_replay.policies.motion_ids import decision_of
from likeme_replay.policies.policy import SAME, Expectant, Found, Policy
from likeme_replay.policies.seen import (
    ARM_FAILED,
    ASK_HUMAN,
    DONE_BY_HAND,
    ENDED,
    EXECUTE,
    GOAL_NAMED,
    HEARD_ANSWER,
    MISSED,
    MOVED,
    NAME_GOAL,
    NOBODY,
    NONE,
    REACHED,
    ROBOT,
    SKIP,
    SKIPPED,
    TRY_ANYWAY,
    UNKNOWN,
    stamp_of,
    state_in,
)

#: Answers by which nothing moves: an outcome follows at once, or the next view.
ENDING = (DONE_BY_HAND, SKIP, NAME_GOAL)


class OutcomesOfDecisions(Policy):
    """An outcome is that of a decision to act or to ask, with its object, x_i and goal."""

    def on_outcome(self, message: Any, _: float) -> Found:
        decision = self.seen.decisions.get(int(message.decision_id))
        if decision is None:
            if self.seen.decisions:
                yield f'Expected the outcome of a decision, got that of {message.decision_id}.'
            return
        expected = (decision.object, decision.x_i, decision.goal)
        got = (message.object, message.x_i, message.goal)
        if decision.kind not in (EXECUTE, ASK_HUMAN) or expected != got:
            yield f'Expected an outcome of {expected}, kind {decision.kind}, got {got}.'


class OutcomesOnce(Policy):
    """A decision has one outcome; only the very same one is told again, after a restart."""

    def on_outcome(self, message: Any, _: float) -> Found:
        known = self.seen.outcomes.get(int(message.decision_id))
        if known is None:
            return
        before, now = ((stamp_of(o), o.result, o.x_f) for o in (known, message))
        if before != now:
            yield f'Expected {before} of decision {message.decision_id} to stay, got {now}.'


class OutcomesAreSeen(Policy):
    """An outcome's x_f is where a settled table state of its stamp shows the object."""

    def on_outcome(self, message: Any, _: float) -> Found:
        stamp, first = stamp_of(message), self.seen.first_stamp
        if message.x_f == UNKNOWN or first is None or stamp < first:
            return
        known = self.seen.outcomes.get(int(message.decision_id))
        if known is not None and stamp_of(known) == stamp:
            # Told again after a restart, when its table state may be long past.
            return
        table = self.seen.tables.get(stamp)
        where = None if table is None else state_in(table, message.object)
        if table is None or where != message.x_f or not table.settled:
            yield f'Expected {message.object} settled in {message.x_f} at {stamp} ns, got {where}.'


class ReachedIsAtTheGoal(Policy):
    """REACHED is an x_f at the goal, MISSED another one, and nothing else has an x_f."""

    def on_outcome(self, message: Any, _: float) -> Found:
        results = {UNKNOWN: None, message.goal: REACHED}
        expected = results.get(message.x_f, MISSED)
        seen = message.result if message.result in (REACHED, MISSED) else None
        if seen != expected:
            yield f'Expected REACHED at the goal alone, got {message.result} in {message.x_f}.'


class OutcomesNameTheAct(Policy):
    """An outcome of the robot has the decision's action and prediction, any other has none."""

    def on_outcome(self, message: Any, _: float) -> Found:
        decision = self.seen.decisions.get(int(message.decision_id))
        if message.actor != ROBOT:
            if message.action != NONE or not math.isnan(message.predicted_success):
                yield f'Expected no action of actor {message.actor}, got {message.action}.'
        elif decision is not None and message.action != decision.action:
            yield f'Expected the action {decision.action}, got {message.action}.'
        elif decision is not None:
            difference = abs(message.predicted_success - decision.predicted_success)
            if not difference <= SAME:
                given = f'{decision.predicted_success:g}, got {message.predicted_success:g}'
                yield f'Expected the predicted success {given}.'


class EndedByAnAnswer(Policy):
    """SKIPPED and GOAL_NAMED are outcomes of questions that an operator answered so."""

    def on_outcome(self, message: Any, _: float) -> Found:
        if message.result not in (SKIPPED, GOAL_NAMED):
            return
        decision = self.seen.decisions.get(int(message.decision_id))
        asked = decision is None or decision.kind == ASK_HUMAN
        if not asked or message.actor != NOBODY:
            yield f'Expected a question that was answered, got decision {message.decision_id}.'


class OutcomesAgreeWithTheArm(Policy):
    """The motion outcome of an outcome is the one that the driver published for its motion."""

    def on_outcome(self, message: Any, _: float) -> Found:
        for motion in self.seen.motions.values():
            if decision_of(motion.id) != int(message.decision_id) or motion.state != ENDED:
                continue
            if message.motion_outcome not in (motion.outcome, NONE):
                yield f'Expected motion outcome {motion.outcome}, got {message.motion_outcome}.'


class LooksAfterTheMotion(Policy):
    """What is REACHED or MISSED by the robot was seen after its motion had ended."""

    def on_outcome(self, message: Any, _: float) -> Found:
        if message.result not in (REACHED, MISSED) or message.actor != ROBOT:
            return
        for motion in self.seen.motions.values():
            if decision_of(motion.id) == int(message.decision_id):
                finished = stamp_ns(motion.finished)
                if motion.state != ENDED or stamp_of(message) <= finished:
                    yield f'Expected a view after the motion, got one of {stamp_of(message)} ns.'


class EveryMotionIsFollowedUp(Expectant):
    """Within a bound after its motion or the operator's answer, a decision has an outcome."""

    def on_motion(self, message: Any, now: float) -> Found:
        decision = decision_of(message.id)
        if message.state == ENDED and decision is not None and self.seen.is_open(decision):
            self._expect(decision, now)
        yield from ()

    def on_heard(self, message: Any, now: float) -> Found:
        by_hand = message.kind == HEARD_ANSWER and message.answer in ENDING
        asked = self.seen.answered(message) if by_hand and not message.refused else None
        if asked is not None and self.seen.is_open(int(asked.id)):
            self._expect(int(asked.id), now)
        yield from ()

    def on_outcome(self, message: Any, _: float) -> Found:
        self._expected.meet(int(message.decision_id))
        yield from ()

    def _expect(self, decision: int, now: float) -> None:
        sentence = f'Expected an outcome of decision {decision} by now, got none.'
        self._expected.expect(decision, now + self.bounds.outcome, sentence)


class EveryActIsTried(Expectant):
    """After a decision to act, or "try anyway", a motion begins or an outcome follows in time."""

    def on_decision(self, message: Any, now: float) -> Found:
        if message.kind == EXECUTE and not self.seen.is_repeated(message):
            self._expect(int(message.id), now)
        yield from ()

    def on_heard(self, message: Any, now: float) -> Found:
        tried = message.kind == HEARD_ANSWER and message.answer == TRY_ANYWAY
        asked = self.seen.answered(message) if tried and not message.refused else None
        if asked is not None and self.seen.is_open(int(asked.id)):
            self._expect(int(asked.id), now)
        yield from ()

    def on_motion(self, message: Any, _: float) -> Found:
        self._expected.meet(decision_of(message.id))
        yield from ()

    def on_outcome(self, message: Any, _: float) -> Found:
        self._expected.meet(int(message.decision_id))
        yield from ()

    def _expect(self, decision: int, now: float) -> None:
        sentence = f'Expected a motion or an outcome of decision {decision} by now, got none.'
        self._expected.expect(decision, now + self.bounds.arm_wait, sentence)


class ArmFailedMovedNothing(Policy):
    """ARM_FAILED is said only where the arm gave no answer, or one by which nothing moved."""

    def on_outcome(self, message: Any, _: float) -> Found:
        if message.result == ARM_FAILED and message.motion_outcome in MOVED:
            yield f'Expected a look at the table, got ARM_FAILED after {message.motion_outcome}.'
