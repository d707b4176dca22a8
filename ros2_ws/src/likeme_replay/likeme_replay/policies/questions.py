"""Policies of the questions to the operator, and of the answers that the session takes."""

from __future__ import annotations

from typing import Any

from likeme_replay.policies.policy import Bounds, Expectant, Found, Policy, close
from likeme_replay.policies.seen import ASK_HUMAN, HEARD_ANSWER, Seen, stamp_of


class QuestionsAreAsked(Expectant):
    """A decision to ask is a question in `ask_human` within a bound."""

    def on_questions(self, message: Any, now: float) -> Found:
        listed = {int(item.id) for item in message.pending}
        for number in listed:
            self._expected.meet(number)
        asking = self.seen.open_decision
        # Only polls show it: without any, nothing is missed.
        if asking is not None and asking.kind == ASK_HUMAN:
            number = int(asking.id)
            if number not in listed | self.seen.answers.keys() and number not in self._expected:
                sentence = f'Expected the question of decision {number} by now, got none.'
                self._expected.expect(number, now + self.bounds.question, sentence)
        yield from ()

    def on_heard(self, message: Any, _: float) -> Found:
        if message.kind == HEARD_ANSWER and not message.refused:
            asked = self.seen.answered(message)
            if asked is not None:
                self._expected.meet(int(asked.id))
        yield from ()

    def on_outcome(self, message: Any, _: float) -> Found:
        self._expected.meet(int(message.decision_id))
        yield from ()


class QuestionsStayOpen(Policy):
    """A question stays in `ask_human` until it is answered, also across restarts."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._listed: set[int] = set()

    def on_questions(self, message: Any, _: float) -> Found:
        listed = {int(item.id) for item in message.pending}
        known = self.seen.answers.keys() | self.seen.outcomes.keys()
        for number in sorted(self._listed - listed - known):
            yield f'Expected the question of decision {number} until it is answered, got none.'
        self._listed = listed


class QuestionsAreOfDecisions(Policy):
    """A question names object, action, states and prediction of its decision, and its stamp."""

    def on_questions(self, message: Any, _: float) -> Found:
        for item in message.pending:
            decision = self.seen.decisions.get(int(item.id))
            if decision is None:
                continue
            expected, got = ((d.object, d.x_i, d.goal, d.action) for d in (decision, item))
            numbers = ((d.predicted_success, d.threshold) for d in (decision, item))
            if expected != got or not close(*numbers) or stamp_of(item) != stamp_of(decision):
                yield f'Expected the question {expected} of decision {item.id}, got {got}.'


class AnsweredQuestionsClose(Policy):
    """A question that was answered is not asked again."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        # The answer of `ask_human` may have been under way when the question was answered.
        self._once: set[int] = set()

    def on_questions(self, message: Any, _: float) -> Found:
        known = self.seen.answers.keys() | self.seen.outcomes.keys()
        closed = {int(item.id) for item in message.pending} & known
        for number in sorted(closed & self._once):
            yield f'Expected question {number} to be closed, got it again.'
        self._once = closed


class AnswersCountOnce(Policy):
    """The session takes one answer to a question, and none where it has not asked."""

    def on_heard(self, message: Any, _: float) -> Found:
        if message.kind != HEARD_ANSWER or message.refused:
            return
        asking = self.seen.answered(message)
        if asking is None:
            if self.seen.decisions:
                yield 'Expected an open question when an answer is taken, got none.'
        elif int(asking.id) in self.seen.answers:
            yield f'Expected one answer to question {asking.id}, got another.'


class AnswersHaveAName(Policy):
    """An answer that the session takes says who answered."""

    def on_heard(self, message: Any, _: float) -> Found:
        if message.kind == HEARD_ANSWER and not message.refused and not message.message:
            yield 'Expected who answered, got nothing.'
