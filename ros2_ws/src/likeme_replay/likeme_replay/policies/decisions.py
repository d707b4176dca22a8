"""Policies of single decisions: their numbers, and what they follow from."""

from __future__ import annotations

from typing import Any

from likeme_core.stamps import stamp_ns
from likeme_replay.policies.policy import SAME, Bounds, Found, Policy, close, distribution
from likeme_replay.policies.seen import (
    ASK_HUMAN,
    AT_GOAL,
    EXECUTE,
    NO_ACTION,
    NONE,
    Seen,
    stamp_of,
    state_in,
)

ASKING_MODES = ('interactive', 'sequential')


class DecisionsFollowDemonstrations(Policy):
    """No decision is made without a demonstration, or a joint goal, of its object before it."""

    def on_decision(self, message: Any, _: float) -> Found:
        shown, first = stamp_ns(message.demonstration), self.seen.first_stamp
        if first is None or shown < first:
            return
        known = self.seen.demonstrations.keys() | self.seen.joint_goals.keys()
        if (shown, message.object) not in known:
            yield f'Expected a demonstration of {message.object} at {shown} ns, got none.'


class DecisionIdsCountUp(Policy):
    """Ids of decisions grow by one, also across restarts; only the last one is told again."""

    def on_decision(self, message: Any, _: float) -> Found:
        last = self.seen.decision
        if last is None or message.id == last.id + 1:
            return
        if message.id != last.id or not self.seen.is_repeated(message):
            yield f'Expected the id {last.id + 1}, got {message.id}.'


class DecisionsStay(Policy):
    """A decision that is told again is the same in every number."""

    def on_decision(self, message: Any, _: float) -> Found:
        known = self.seen.decisions.get(int(message.id))
        if known is None or not self.seen.is_repeated(message):
            return
        expected, got = (
            (d.x_i, d.goal, d.action, d.mode, close(d.goal_posterior, known.goal_posterior))
            for d in (known, message)
        )
        if expected != got:
            yield f'Expected decision {message.id} to stay {expected}, got {got}.'


class DecisionsKeepTheBelief(Policy):
    """Goal and posterior of a decision are the belief's, of the same model and parameters."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._changed = False

    def on_parameter_events(self, message: Any, _: float) -> Found:
        if message.node.endswith('inference_node') and len(message.changed_parameters):
            self._changed = True
        yield from ()

    def on_goal_belief(self, _message: Any, _: float) -> Found:
        self._changed = False
        yield from ()

    def on_decision(self, message: Any, _: float) -> Found:
        belief = self.seen.beliefs.get((stamp_ns(message.demonstration), message.object))
        if self.seen.is_repeated(message):
            # The operator may have named another goal since.
            return
        if belief is None or belief.model != message.model or self._changed:
            return
        if message.goal != belief.goal or not close(message.goal_posterior, belief.posterior):
            got = f'{list(message.goal_posterior)}, goal {message.goal}'
            yield f'Expected {list(belief.posterior)}, goal {belief.goal}, got {got}.'


class DecidedGoalIsMostProbable(Policy):
    """The posterior of a decision is a distribution, of which its goal is a mode."""

    def on_decision(self, message: Any, _: float) -> Found:
        posterior = list(message.goal_posterior)
        yield from distribution(posterior, self.regions, 'the goal posterior')
        if not message.goal < len(posterior):
            yield f'Expected a goal below {len(posterior)}, got {message.goal}.'
        elif posterior[message.goal] < max(posterior) - SAME:
            yield f'Expected the goal of the greatest probability, got {message.goal}.'


class PredictedIsDistribution(Policy):
    """The prediction of a chosen action sums to 1 over the regions; without one it is empty."""

    def on_decision(self, message: Any, _: float) -> Found:
        if message.action == NONE and len(message.predicted):
            yield f'Expected no prediction without an action, got {list(message.predicted)}.'
        elif message.action != NONE:
            yield from distribution(message.predicted, self.regions, 'the prediction')


class PredictedSuccessIsOfTheGoal(Policy):
    """Predicted success is the predicted probability of the goal under the chosen action."""

    def on_decision(self, message: Any, _: float) -> Found:
        success, predicted = list(message.success_probability), list(message.predicted)
        if message.action >= len(success) or message.goal >= len(predicted):
            return
        given = message.predicted_success
        if not close([predicted[message.goal], success[message.action]], [given, given]):
            expected = f'{predicted[message.goal]:g}, {success[message.action]:g}'
            yield f'Expected the predicted success {expected}, got {given:g}.'


class ActionProbabilities(Policy):
    """p(A) of a decision sums to 1, or is all zero; success probabilities are from 0 to 1."""

    def on_decision(self, message: Any, _: float) -> Found:
        size = None if self.seen.world is None else len(self.seen.world.actions)
        if any(message.action_probability):
            yield from distribution(message.action_probability, size, 'p(A)')
        bad = [p for p in message.success_probability if not 0 <= p <= 1 + SAME]
        if bad:
            yield f'Expected success probabilities from 0 to 1, got {bad[0]:g}.'


class ActionIsKnown(Policy):
    """A decision to act or to ask names an action of the world, no other one does."""

    def on_decision(self, message: Any, _: float) -> Found:
        count = NONE if self.seen.world is None else len(self.seen.world.actions)
        names, needs = message.action < count, message.kind in (EXECUTE, ASK_HUMAN)
        if needs and not names:
            yield f'Expected an action below {count}, got {message.action}.'
        elif message.kind in (AT_GOAL, NO_ACTION) and message.action != NONE:
            yield f'Expected no action ({NONE}), got {message.action}.'


class AtGoalIsAtTheGoal(Policy):
    """A decision is AT_GOAL if and only if the object was seen in the goal."""

    def on_decision(self, message: Any, _: float) -> Found:
        if (message.kind == AT_GOAL) != (message.x_i == message.goal):
            yield f'Expected AT_GOAL in the goal alone, got {message.kind} in {message.x_i}.'


class AsksOnlyBelowTheThreshold(Policy):
    """Asking by threshold, it asks only below it, where no action helps, or one was not free."""

    def on_decision(self, message: Any, _: float) -> Found:
        if message.kind != ASK_HUMAN or message.mode not in ASKING_MODES:
            return
        if not self.seen.by_threshold(message) or self.seen.was_not_free(message):
            return
        sure = _sureness(message)
        if sure > message.threshold + SAME and message.plan_value > 0:
            yield f'Expected to act on {sure:g}, above {message.threshold:g}; it asks.'


class ActsOnlyAtTheThreshold(Policy):
    """Asking by threshold, it acts only if it is as sure as the threshold demands."""

    def on_decision(self, message: Any, _: float) -> Found:
        if message.kind != EXECUTE or message.mode not in ASKING_MODES:
            return
        if not self.seen.by_threshold(message):
            return
        sure = _sureness(message)
        if sure < message.threshold - SAME:
            yield f'Expected to ask on {sure:g}, below {message.threshold:g}; it acts.'


class OnlyAskingModesAsk(Policy):
    """Only the interactive and the sequential mode ask."""

    def on_decision(self, message: Any, _: float) -> Found:
        if message.kind == ASK_HUMAN and message.mode not in ASKING_MODES:
            yield f'Expected {message.mode} to choose by itself, it asks.'


class BudgetCountsDown(Policy):
    """Actions left go down with each action begun for one demonstration; else there is one."""

    def __init__(self, seen: Seen, bounds: Bounds) -> None:
        super().__init__(seen, bounds)
        self._last: Any = None

    def on_decision(self, message: Any, _: float) -> Found:
        if self.seen.is_repeated(message):
            return
        last, self._last = self._last, message
        if message.mode != 'sequential':
            if message.actions_left != 1:
                yield f'Expected 1 action in {message.mode} mode, got {message.actions_left}.'
            return
        if last is None or last.mode != 'sequential' or last.kind != EXECUTE:
            return
        same = stamp_ns(last.demonstration) == stamp_ns(message.demonstration)
        if not same or last.object != message.object:
            return
        most = last.actions_left - 1 + self.seen.was_not_free(last)
        if message.actions_left > max(0, most):
            yield f'Expected at most {most} actions, got {message.actions_left}.'


class DecidesOnASettledTable(Policy):
    """A decision has the stamp of a settled table state, in which its object is in x_i."""

    def on_decision(self, message: Any, _: float) -> Found:
        stamp, first = stamp_of(message), self.seen.first_stamp
        if first is None or stamp < first:
            return
        known = self.seen.decisions.get(int(message.id))
        if known is not None and stamp_of(known) == stamp:
            # Told again after a restart, when its table state may be long past.
            return
        table = self.seen.tables.get(stamp)
        if table is None:
            yield f'Expected a table state of {stamp} ns, got none before the decision.'
        elif not table.settled or state_in(table, message.object) != message.x_i:
            where = state_in(table, message.object)
            got = f'{message.object} in {where}, settled {table.settled}'
            yield f'Expected a settled table with {message.object} in {message.x_i}, got {got}.'


class OneDecisionAtATime(Policy):
    """No decision is made while another one waits for its outcome.

    A question that nobody has answered waits beside decisions on other objects.
    """

    def on_decision(self, message: Any, _: float) -> Found:
        waiting = self.seen.open_decision
        if waiting is None or waiting.id == message.id:
            return
        unanswered = waiting.kind == ASK_HUMAN and int(waiting.id) not in self.seen.answers
        if not unanswered or waiting.object == message.object:
            yield f'Expected the outcome of decision {waiting.id} first, got {message.id}.'


def _sureness(decision: Any) -> float:
    """What a decision's mode compares with the threshold."""
    sequential = decision.mode == 'sequential'
    return float(decision.plan_value if sequential else decision.predicted_success)
