"""What to do about a goal: action posterior, prediction, when to ask (Fig 3e, 3f; 8b, 8c)."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

from likeme_core.tabletop import Mode
from likeme_inference.tabletop.checks import number
from likeme_inference.tabletop.goal_inference import TIE, map_index
from likeme_inference.tabletop.goal_model import GoalModel


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
        actions_left: how many actions there were to plan with; 1 but in the sequential mode.
        plan_success: P(goal within actions_left), a first, then the best each time; shape [a].
        plan_value: the greatest of them, what the sequential mode holds against the threshold.
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
    of its twelve predictions equals 0.5, so Table 1 fits both. Here exactly 50% sure is enough,
    however its sum was rounded.
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
    """Choose what to do with an object seen in x_i that is wanted at the goal.

    trajectory repeats `demonstrated`, whatever it leads to; goal_based takes a_MAP; interactive
    takes a_MAP too, but asks when it would probably fail; sequential takes the first action of the
    best plan with the actions that are left, and asks when even that would probably fail. Where
    nothing can be done (the object is out of reach, no action was ever seen to reach the goal, no
    action is left) interactive and sequential ask at any threshold and the others choose no
    action, except that trajectory repeats what is within its reach.

    Args:
        model: of the object; ties and reach follow its domain.
        x_i: where it is.
        goal: where it is wanted.
        demonstrated: what trajectory repeats; may be None in the other modes.
        mode: see above.
        threshold: below which interactive and sequential ask.
        actions_left: what sequential may plan with.

    Raises:
        ValueError: trajectory without a demonstrated action; no such state, goal, action or mode;
            a threshold that is no probability.
    """
    states, goals, actions = model.policy.shape
    mode, x_i, goal = Mode(mode), number('x_i', x_i, states), number('goal', goal, goals)
    if demonstrated is not None:
        demonstrated = number('demonstrated', demonstrated, actions)
    if not 0 <= threshold <= 1:
        raise ValueError(f'Expected a threshold from 0 to 1, got {threshold}.')
    if mode is Mode.TRAJECTORY and demonstrated is None:
        raise ValueError('Expected the demonstrated action to repeat, got None.')
    posterior, success = model.policy[x_i, goal], model.success(x_i, goal).tolist()
    planned = _plan(model, x_i, goal, actions_left if mode is Mode.SEQUENTIAL else 1)

    def chosen(kind: Kind, action: int | None = None, predicted: tuple[float, ...] = ()) -> Choice:
        return Choice(
            kind, action, tuple(posterior.tolist()), tuple(success), predicted,
            math.nan if action is None else success[action],
            planned.left, planned.success, planned.value,
        )  # fmt: skip

    if model.goals[goal, x_i]:
        return chosen(Kind.AT_GOAL)
    action, hopeless = demonstrated, bool(model.stuck[x_i])
    if mode is not Mode.TRAJECTORY or action is None:
        action, hopeless = map_index(posterior, model.aimed(goal)), planned.value <= 0
        if mode is Mode.SEQUENTIAL and not hopeless:
            action = planned.first
    may_ask = mode in (Mode.INTERACTIVE, Mode.SEQUENTIAL)
    if hopeless and not may_ask:
        return chosen(Kind.NO_ACTION)
    sure = planned.value if mode is Mode.SEQUENTIAL else success[action]
    kind = Kind.ASK_HUMAN if may_ask and (hopeless or asks(sure, threshold)) else Kind.EXECUTE
    return chosen(kind, action, tuple(model.transition[x_i, action].tolist()))


class _Planned(NamedTuple):
    """The best plan seen from one state: its first action, and Choice's last three fields."""

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
