"""Acting more than once: what looking again is worth, exactly (the paper leaves it open)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_core.tabletop import State
from likeme_experiments.evaluation.demonstrations import CHANGES
from likeme_inference.tabletop.action_selection import asks
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.planning import Plan, spread
from likeme_inference.tabletop.robot_model import RobotModel

BUDGETS = (1, 2, 3, 5, 10)
#: "with a 100% success rate when the human executes the requested action"
HUMAN_SUCCESS = 1.0


class Row(NamedTuple):
    """One object with one number of actions, averaged over the four changes.

    Attributes:
        success: of reaching the goal by the best plan, without ever asking.
        help_rate: how often a robot that asks once its actions are spent has to.
        success_with_help: with that human's help, wherever the object is by then.
        threshold_help_rate: how often the sequential mode asks, which does so as soon as its best
            plan is worth less than the threshold, be it before the first action.
    """

    actions: int
    object: str
    success: float
    help_rate: float
    success_with_help: float
    threshold_help_rate: float


def sequential(
    model: RobotModel, budgets: tuple[int, ...] = BUDGETS, threshold: float = 0.5
) -> list[Row]:
    """Compute every row; nothing is sampled."""
    return [_row(model, name, n, threshold) for n in budgets for name in model.objects]


def _row(model: RobotModel, name: str, actions: int, threshold: float) -> Row:
    known = model.goal_model(name)
    success, asked = [], []
    for x_i, g in CHANGES:
        best = known.plan(g, actions)
        reached = float(spread(known.transition, best, x_i, actions)[actions] @ known.goals[g])
        success.append(reached)
        asked.append(_asks(known.transition, best, g, x_i, actions, threshold))
    reached, asks = float(np.mean(success)), float(np.mean(asked))
    return Row(actions, name, reached, 1 - reached, reached + (1 - reached) * HUMAN_SUCCESS, asks)


def _asks(
    transition: FloatArray, best: Plan, goal: State, x_i: State, actions: int, threshold: float
) -> float:
    """P(the robot asks sooner or later), following the plan until its value is too low."""
    here = np.eye(len(transition))[x_i]
    asked = 0.0
    for left in range(actions, -1, -1):
        gives_up = np.array([asks(v, threshold) or v <= 0 for v in best.value[left].tolist()])
        asked += float(here[gives_up].sum())
        here = np.where(gives_up, 0.0, here)
        if left:
            chosen = best.action[left].clip(min=0)
            moved = here[:, None] * transition[np.arange(len(transition)), chosen]
            moved[goal] = np.eye(len(transition))[goal] * here[goal]
            here = moved.sum(axis=0)
    return asked
