"""Several actions with a look after each: exact success and help rates (beyond the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from likeme_core.tabletop import State
from likeme_core.world import World
from likeme_experiments.evaluation.demonstrations import changes_of
from likeme_inference.tabletop.action_selection import asks
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.planning import Plan, spread
from likeme_inference.tabletop.robot_model import RobotModel

BUDGETS = (1, 2, 3, 5, 10)
#: "with a 100% success rate when the human executes the requested action"
HUMAN_SUCCESS = 1.0


class SequentialRow(NamedTuple):
    """One object with one number of actions, averaged over the changes.

    Attributes:
        success: probability of reaching the goal by the best plan without help.
        help_rate: of a robot that asks after its last action.
        success_with_help: with that help, wherever the object is.
        threshold_help_rate: of the sequential mode, which asks as soon as its best plan succeeds
            with less than the threshold, possibly before the first action.
    """

    actions: int
    object: str
    success: float
    help_rate: float
    success_with_help: float
    threshold_help_rate: float


def sequential(
    model: RobotModel, world: World, budgets: tuple[int, ...] = BUDGETS, threshold: float = 0.5
) -> list[SequentialRow]:
    """Compute every row, without sampling."""
    return [
        _row(model, changes_of(world), name, n, threshold)
        for n in budgets
        for name in model.objects
    ]


def _row(
    model: RobotModel,
    changes: Sequence[tuple[State, State]],
    name: str,
    actions: int,
    threshold: float,
) -> SequentialRow:
    known = model.goal_model(name)
    success, asked = [], []
    for x_i, g in changes:
        best = known.plan(g, actions)
        reached = float(spread(known.transition, best, x_i, actions)[actions] @ known.goals[g])
        success.append(reached)
        asked.append(_asks(known.transition, best, g, x_i, actions, threshold))
    reached, asks = float(np.mean(success)), float(np.mean(asked))
    return SequentialRow(
        actions, name, reached, 1 - reached, reached + (1 - reached) * HUMAN_SUCCESS, asks
    )


def _asks(
    transition: FloatArray, best: Plan, goal: State, x_i: State, actions: int, threshold: float
) -> float:
    """P(the robot asks), following the plan until its value is too low."""
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
