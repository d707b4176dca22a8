"""Action selection for a goal: action posterior, prediction, asking (Fig 3e, 3f; 8b, 8c)."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

from likeme_core.tabletop import Mode
from likeme_inference.tabletop.checks import number
from likeme_inference.tabletop.goal_inference import TIE, map_index
from likeme_inference.tabletop.goal_model import GoalModel


class Kind(IntEnum):
    """Kind of a decision; the numbers of likeme_msgs/Decision."""

    EXECUTE = 0
    ASK_HUMAN = 1
    AT_GOAL = 2
    NO_ACTION = 3


class Choice(NamedTuple):
    """A choice and the quantities it follows from.

    Attributes:
        kind: execute, ask, at the goal, or no action.
        action: the chosen action; None for AT_GOAL and NO_ACTION.
        action_probability: P(A | x_i, G = goal), shape [a]; all zero if none reaches the goal.
        success_probability: P(X_f = goal | x_i, A), shape [a].
        predicted: P(X_f | x_i, A = action), shape [x_f]; empty without an action.
        predicted_success: P(X_f = goal) under the action; NaN without one.
        actions_left: number of actions planned with; 1 except in sequential mode.
        plan_success: P(goal within actions_left), a first, then the best each time; shape [a].
        plan_value: the greatest of them, which sequential mode compares with the threshold.
    """

    kind: Kind
    action: int | None
    action_probability: tuple[float, ...]
    success_probability: tuple[float, ...]
    predicted: tuple[float, ...]
    predicted_success: float
    actions_left: int
    plan_success: tuple[float, ...]
    plan_value: float


def asks(predicted_success: float, threshold: float) -> bool:
    """Whether the interactive mode asks: predicted success below the threshold.

    The paper words the edge both ways: "above a prespecified threshold, tau, the robot executes",
    but "the threshold below which the robot asks" under Fig 8c and "50% sure" for Table 1. None
    of its twelve predictions equals 0.5, so Table 1 is consistent with both. Here exactly the
    threshold, up to rounding, is enough to execute.
    """
    return predicted_success < threshold * (1 - TIE)


def choose(
    model: GoalModel,
    x_i: int,
    goal: int,
    demonstrated: int | None,
    mode: Mode,
    threshold: float,
    actions_left: int = 1,
) -> Choice:
    """Choose the action for an object observed in x_i whose goal is `goal`.

    trajectory repeats `demonstrated`; goal_based takes a_MAP; interactive takes a_MAP, but asks if
    its predicted success is below the threshold; sequential takes the first action of the best
    plan with the actions left, and asks if the plan's value is below the threshold. If nothing can
    be done (object out of reach, no action ever reached the goal, no action left), interactive and
    sequential ask at any threshold and the others choose no action; trajectory still repeats the
    demonstrated action if the object is within reach.

    Args:
        model: of the object; its domain decides ties and reach.
        x_i: its current state.
        goal: number of the goal.
        demonstrated: action that trajectory repeats; may be None in the other modes.
        mode: see above.
        threshold: success probability below which interactive and sequential ask.
        actions_left: budget of sequential.

    Raises:
        ValueError: trajectory without a demonstrated action; an unknown state, goal, action or
            mode; a threshold outside 0 to 1.
    """
    states, goals, actions = model.policy.shape
    mode, x_i, goal = Mode(mode), number('x_i', x_i, states), number('goal', goal, goals)
    if demonstrated is not None:
        demonstrated = number('demonstrated', demonstrated, actions)
    if not 0 <= threshold <= 1:
        raise ValueError(f'Expected a threshold from 0 to 1, got {threshold}.')
    if mode is Mode.TRAJECTORY and demonstrated is None:
        raise ValueError('Expected the demonstrated action to repeat, got None.')
    left = actions_left if mode is Mode.SEQUENTIAL else 1
    known: _Options = model.answers.get(
        (_Options, x_i, goal, left), lambda: _options(model, x_i, goal, left)
    )
    nothing = known.choice
    if nothing.kind is Kind.AT_GOAL:
        return nothing
    action, hopeless = demonstrated, known.stuck
    if mode is not Mode.TRAJECTORY or action is None:
        hopeless = nothing.plan_value <= 0
        action = known.first if mode is Mode.SEQUENTIAL and not hopeless else known.best
    may_ask = mode is Mode.INTERACTIVE or mode is Mode.SEQUENTIAL
    if hopeless and not may_ask:
        return nothing
    success = nothing.success_probability[action]
    sure = nothing.plan_value if mode is Mode.SEQUENTIAL else success
    kind = Kind.ASK_HUMAN if may_ask and (hopeless or asks(sure, threshold)) else Kind.EXECUTE
    return Choice(
        kind, action, nothing.action_probability, nothing.success_probability,
        known.predicted[action], success,
        nothing.actions_left, nothing.plan_success, nothing.plan_value,
    )  # fmt: skip


class _Options(NamedTuple):
    """What there is to choose from for a goal, in one state.

    Attributes:
        choice: to do nothing, because the object is at the goal (AT_GOAL) or else (NO_ACTION).
        best: the MAP action. first: that of the best plan.
        predicted: P(X_f | x_i, a) of every action.
        stuck: whether the object is out of reach.
    """

    choice: Choice
    best: int
    first: int
    predicted: tuple[tuple[float, ...], ...]
    stuck: bool


def _options(model: GoalModel, x_i: int, goal: int, left: int) -> _Options:
    posterior, planned = model.policy[x_i, goal].tolist(), _plan(model, x_i, goal, left)
    choice = Choice(
        Kind.AT_GOAL if model.goals[goal, x_i] else Kind.NO_ACTION,
        None,
        tuple(posterior),
        tuple(model.success(x_i, goal).tolist()),
        (),
        math.nan,
        planned.left,
        planned.success,
        planned.value,
    )
    return _Options(
        choice,
        map_index(posterior, model.aimed(goal)),
        planned.first,
        tuple(tuple(row) for row in model.transition[x_i].tolist()),
        bool(model.stuck[x_i]),
    )


class _Planned(NamedTuple):
    """The best plan from one state: its first action, and the last three fields of Choice."""

    first: int
    left: int
    success: tuple[float, ...]
    value: float


def _plan(model: GoalModel, x_i: int, goal: int, left: int) -> _Planned:
    if left == 1:
        # One action needs no iteration: its value is its success.
        resting = bool(model.stuck[x_i]) or bool(model.goals[goal, x_i])
        held = (float(model.goals[goal, x_i]),) * model.transition.shape[1]
        success = held if resting else tuple(model.success(x_i, goal).tolist())
        return _Planned(map_index(success, model.aimed(goal)), 1, success, max(success))
    best = model.plan(goal, left)
    quality, value = best.quality[left, x_i].tolist(), float(best.value[left, x_i])
    return _Planned(int(best.action[left, x_i]), left, tuple(quality), value)
