"""The cores' values as what crosses the network: the same fields as the messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from likeme_core.observations import Demonstration
from likeme_core.outcomes import MotionOutcome
from likeme_inference.tabletop.values import Decision, GoalBelief, MotionReport, Outcome, Reply
from likeme_replay.decision_log import Entry, Event

#: "None" where a message has a number for an action, a motion outcome; of an object not seen.
NONE = 255
UNKNOWN = 3


def motion_report(said: Any) -> MotionReport:
    """The arm's answer in a recorded Heard."""
    known = said.motion_outcome in set(MotionOutcome)
    ended = said.finished
    finished = ended if isinstance(ended, int) else ended.sec * 1_000_000_000 + ended.nanosec
    outcome = MotionOutcome(said.motion_outcome) if known else None
    return MotionReport(outcome, said.message, int(finished))


def reply(said: Any) -> Reply:
    """The operator's answer in a recorded Heard.

    Raises:
        ValueError: it is none.
    """
    return Reply(said.answer)


def act_entry(act: Demonstration) -> Entry:
    """The entry of a demonstration, with the fields of likeme_msgs/Demonstration."""
    fields = {
        'frame_id': act.frame,
        'object': act.object,
        'x_i': int(act.x_i),
        'x_f': int(act.x_f),
        'x_i_probability': _floats(act.x_i_probability),
        'x_f_probability': _floats(act.x_f_probability),
        'manner': int(act.manner),
        'manner_probability': float(act.manner_probability),
        'rise': float(act.rise),
        'start': act.start,
        'end': act.end,
    }
    return Entry(Event.DEMONSTRATION, act.stamp, fields)


def entry(told: GoalBelief | Decision | Outcome) -> Entry:
    """The entry of what a session came to, with the fields of its message."""
    if isinstance(told, GoalBelief):
        return Entry(Event.BELIEF, told.stamp, _belief(told))
    if isinstance(told, Decision):
        return Entry(Event.DECISION, told.stamp, _decision(told))
    return Entry(Event.OUTCOME, told.stamp, _outcome(told))


def _belief(belief: GoalBelief) -> Mapping[str, Any]:
    return {
        'frame_id': belief.frame,
        'object': belief.object,
        'x_i': int(belief.x_i),
        'x_f': int(belief.x_f),
        'prior': _floats(belief.prior),
        'posterior': _floats(belief.posterior),
        'goal': int(belief.goal),
        'model': belief.model,
    }


def _decision(decision: Decision) -> Mapping[str, Any]:
    return {
        'frame_id': decision.frame,
        'id': decision.id,
        'demonstration': decision.demonstration,
        'mode': str(decision.mode),
        'object': decision.object,
        'x_i': int(decision.x_i),
        'goal': int(decision.goal),
        'goal_posterior': _floats(decision.goal_posterior),
        'kind': int(decision.kind),
        'action': NONE if decision.action is None else int(decision.action),
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


def _outcome(outcome: Outcome) -> Mapping[str, Any]:
    return {
        'frame_id': outcome.frame,
        'decision_id': outcome.decision_id,
        'object': outcome.object,
        'x_i': int(outcome.x_i),
        'goal': int(outcome.goal),
        'x_f': UNKNOWN if outcome.x_f is None else int(outcome.x_f),
        'result': int(outcome.result),
        'actor': int(outcome.actor),
        'action': NONE if outcome.action is None else int(outcome.action),
        'predicted_success': float(outcome.predicted_success),
        'motion_outcome': NONE if outcome.motion is None else int(outcome.motion),
        'sentence': outcome.sentence,
    }


def _floats(values: Any) -> list[float]:
    return [float(value) for value in values]
