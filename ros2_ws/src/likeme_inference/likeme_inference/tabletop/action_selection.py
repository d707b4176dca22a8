"""What to do about a goal: action posterior, prediction, when to ask (Fig 3e, 3f; 8b, 8c)."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

from likeme_inference.tabletop.domain import OUT_OF_REACH, Action, Mode, State
from likeme_inference.tabletop.goal_inference import direct_policy, map_index
from likeme_inference.tabletop.transition_model import FloatArray, TransitionModel


class Kind(IntEnum):
    """What a decision comes to; the numbers of likeme_msgs/Decision."""

    EXECUTE = 0
    ASK_HUMAN = 1
    AT_GOAL = 2
    NO_ACTION = 3


class Choice(NamedTuple):
    """A choice and every number behind it.

    Attributes:
        kind: what it comes to.
        action: the chosen action; None for AT_GOAL and NO_ACTION.
        action_probability: P(A | x_i, G = goal), shape [a]; all zero if none reaches the goal.
        success_probability: P(X_f = goal | x_i, A), shape [a].
        predicted: P(X_f | x_i, A = action), shape [x_f]; empty without an action.
        predicted_success: P(X_f = goal) under the action; NaN without one.
    """

    kind: Kind
    action: Action | None
    action_probability: tuple[float, ...]
    success_probability: tuple[float, ...]
    predicted: tuple[float, ...]
    predicted_success: float


def map_action(action_probability: FloatArray, goal: State) -> Action:
    """Take the MAP action; among equals one that aims at the goal, then the lowest number."""
    return Action(map_index(action_probability, tuple(a for a in Action if a.target == goal)))


def asks(predicted_success: float, threshold: float) -> bool:
    """Whether the interactive mode asks: predicted success below the threshold.

    The paper words the edge both ways: "above a prespecified threshold, tau, the robot executes",
    but "the threshold below which the robot asks" under Fig 8c and "50% sure" for Table 1. None
    of its twelve predictions equals 0.5, so Table 1 fits both. Here exactly 50% sure is enough.
    """
    return predicted_success < threshold


def choose(
    model: TransitionModel,
    x_i: State,
    goal: State,
    demonstrated: Action,
    mode: Mode,
    threshold: float,
) -> Choice:
    """Choose what to do with an object seen in x_i that is wanted at the goal.

    trajectory repeats `demonstrated`, whatever it leads to; goal_based takes a_MAP; interactive
    takes a_MAP too, but asks when it would probably fail. Where nothing can be done (the object is
    out of reach, or no action was ever seen to reach the goal) interactive asks at any threshold
    and the others choose no action, except that trajectory repeats what is within its reach.
    """
    posterior = direct_policy(model.transition)[x_i, goal]
    success = model.transition[x_i, :, goal]
    known = (tuple(posterior.tolist()), tuple(success.tolist()))
    if x_i == goal:
        return Choice(Kind.AT_GOAL, None, *known, (), math.nan)
    action, hopeless = demonstrated, x_i in OUT_OF_REACH
    if mode is not Mode.TRAJECTORY:
        action, hopeless = map_action(posterior, goal), hopeless or not success.any()
    if hopeless and mode is not Mode.INTERACTIVE:
        return Choice(Kind.NO_ACTION, None, *known, (), math.nan)
    ask = mode is Mode.INTERACTIVE and (hopeless or asks(float(success[action]), threshold))
    kind = Kind.ASK_HUMAN if ask else Kind.EXECUTE
    predicted = tuple(model.transition[x_i, action].tolist())
    return Choice(kind, action, *known, predicted, float(success[action]))
