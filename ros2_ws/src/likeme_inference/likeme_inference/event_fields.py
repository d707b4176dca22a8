"""The fields of GoalBelief, Decision and Outcome, for the messages and for the decision log.

Each function gives all fields but header and world, in the message's order; times in ns.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from likeme_inference.tabletop.values import Decision, GoalBelief, Outcome

#: Number of a missing action or motion outcome, and of the state of an object that is not seen.
NONE = UNKNOWN = 255


def belief_fields(belief: GoalBelief) -> dict[str, Any]:
    """The fields of likeme_msgs/GoalBelief."""
    return {
        'object': belief.object,
        'x_i': int(belief.x_i),
        'x_f': int(belief.x_f),
        'prior': _floats(belief.prior),
        'posterior': _floats(belief.posterior),
        'goal': int(belief.goal),
        'model': belief.model,
    }


def decision_fields(decision: Decision) -> dict[str, Any]:
    """The fields of likeme_msgs/Decision."""
    return {
        'id': decision.id,
        'demonstration': decision.demonstration,
        'mode': str(decision.mode),
        'object': decision.object,
        'x_i': int(decision.x_i),
        'goal': int(decision.goal),
        'goal_posterior': _floats(decision.goal_posterior),
        'kind': int(decision.kind),
        'action': _number(decision.action, NONE),
        'action_probability': _floats(decision.action_probability),
        'success_probability': _floats(decision.success_probability),
        'predicted': _floats(decision.predicted),
        'predicted_success': float(decision.predicted_success),
        'actions_left': decision.actions_left,
        'plan_success': list(decision.plan_success),
        'plan_value': float(decision.plan_value),
        'threshold': float(decision.threshold),
        'policy': str(decision.policy),
        'model': decision.model,
        'sentence': decision.sentence,
    }


def outcome_fields(outcome: Outcome) -> dict[str, Any]:
    """The fields of likeme_msgs/Outcome."""
    return {
        'decision_id': outcome.decision_id,
        'object': outcome.object,
        'x_i': int(outcome.x_i),
        'goal': int(outcome.goal),
        'x_f': _number(outcome.x_f, UNKNOWN),
        'result': int(outcome.result),
        'actor': int(outcome.actor),
        'action': _number(outcome.action, NONE),
        'predicted_success': float(outcome.predicted_success),
        'motion_outcome': _number(outcome.motion, NONE),
        'sentence': outcome.sentence,
    }


def _number(value: int | None, missing: int) -> int:
    return missing if value is None else int(value)


def _floats(values: Iterable[float]) -> list[float]:
    return [float(value) for value in values]
