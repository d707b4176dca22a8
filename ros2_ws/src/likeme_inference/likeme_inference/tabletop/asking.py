"""When the robot asks rather than acts: by a threshold, by what it costs, to keep a promise."""

from __future__ import annotations

from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from likeme_core.tabletop import Mode
from likeme_inference.tabletop.action_selection import Choice, Kind, asks, choose
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.cost_planning import CostChoice, Costs, choose_by_cost
from likeme_inference.tabletop.goal_inference import map_goal
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.intended_success import (
    intended_plan_success,
    intended_success,
    meant,
)

#: Modes that ask.
ASKING_MODES = (Mode.INTERACTIVE, Mode.SEQUENTIAL)


class Asking(StrEnum):
    """What decides whether the interactive and the sequential mode ask."""

    #: The paper: predicted success below a threshold, the likeliest goal taken as certain.
    THRESHOLD = 'threshold'
    #: What is expected to cost least, see cost_planning.py.
    COST = 'cost'
    #: A threshold that follows the outcomes, so that a promise is kept, see promise.py.
    PROMISE = 'promise'


def choose_to_keep(
    model: GoalModel,
    x_i: int,
    goal: int,
    belief: ArrayLike,
    mode: Mode,
    threshold: float,
    actions_left: int = 1,
) -> tuple[Choice, float]:
    """The action for a goal; asks if success at the goal that was meant is below the threshold.

    That success is in interactive mode `intended_success` of the action, in sequential mode
    `intended_plan_success`, by a belief as there.

    Returns:
        The choice, and that success; NaN without an action.
    """
    choice = choose(model, x_i, goal, None, mode, 0.0, actions_left)
    if choice.action is None:
        return choice, float('nan')
    if mode is Mode.SEQUENTIAL:
        sure = intended_plan_success(model, x_i, belief, goal, actions_left)
    else:
        sure = float(intended_success(model, x_i, belief)[choice.action])
    return (choice._replace(kind=Kind.ASK_HUMAN) if asks(sure, threshold) else choice), sure


def choose_least_cost(
    model: GoalModel,
    x_i: int,
    goal: int,
    posterior: ArrayLike,
    mode: Mode,
    costs: Costs,
    actions_left: int = 1,
) -> tuple[int, Choice, CostChoice]:
    """The goal to pursue, what to do for it, and the expected costs that it follows from.

    An object at `goal`, the likeliest, is left.
    """
    p = np.asarray(posterior, dtype=np.float64)
    key = CostChoice, x_i, goal, p.tobytes(), mode, costs, actions_left
    found: tuple[int, Choice, CostChoice] = model.answers.get(
        key, lambda: _least_cost(model, x_i, goal, p, mode, costs, actions_left)
    )
    return found


def _least_cost(
    model: GoalModel,
    x_i: int,
    goal: int,
    posterior: FloatArray,
    mode: Mode,
    costs: Costs,
    actions_left: int,
) -> tuple[int, Choice, CostChoice]:
    left = actions_left if mode is Mode.SEQUENTIAL else 1
    by_cost = choose_by_cost(model, x_i, posterior, costs, left)
    if not model.goals[goal, x_i] and by_cost.question is None:
        goal = by_cost.goal
    choice = choose(model, x_i, goal, None, mode, 0.0, actions_left)
    if choice.action is None:
        return goal, choice, by_cost
    if by_cost.action is None:
        return goal, choice._replace(kind=Kind.ASK_HUMAN), by_cost
    action = by_cost.action
    chosen = choice._replace(
        kind=Kind.EXECUTE,
        action=action,
        predicted=tuple(model.transition[x_i, action].tolist()),
        predicted_success=choice.success_probability[action],
    )
    return goal, chosen, by_cost


def expected_successes(model: GoalModel, mode: Mode, actions_left: int = 1) -> list[float]:
    """Success at the goal that was meant in each change that can be shown, by the model itself."""
    found = []
    for x_i in np.flatnonzero(~model.stuck).tolist():
        for x_f in range(len(model.transition)):
            if x_f == x_i:
                continue
            posterior = model.goal_posterior(x_i, x_f)
            goal = map_goal(posterior, x_f, model.goals)
            belief = meant(model, x_i, x_f)
            choice, sure = choose_to_keep(model, x_i, goal, belief, mode, 0.0, actions_left)
            if choice.action is not None:
                found.append(sure)
    return found
