"""Table 1: hypothetical success of three approaches, averaged over the changes of state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_core.tabletop import Manner, Mode, State
from likeme_core.world import World
from likeme_experiments.evaluation.demonstrations import changes_of
from likeme_inference.tabletop.action_selection import Kind, choose
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.goal_inference import map_goal
from likeme_inference.tabletop.robot_model import RobotModel

MODES = (Mode.TRAJECTORY, Mode.GOAL_BASED, Mode.INTERACTIVE)
#: Headings of the rows, as the paper has them.
MANNER_NAMES = {
    manner: f'{"Pick & Place" if manner is Manner.PLACE else manner.name.title()} Demonstration'
    for manner in Manner
}
#: As printed in the paper: (manner of the demonstration, object) -> success by mode.
PAPER: dict[tuple[Manner, str], tuple[float, float, float]] = {
    (Manner.PLACE, 'pear'): (0.2250, 0.6750, 0.8250),
    (Manner.PLACE, 'lemon'): (0.5250, 0.6750, 0.6750),
    (Manner.PLACE, 'chicken'): (0.6500, 0.8000, 0.8000),
    (Manner.PUSH, 'pear'): (0.6750, 0.6750, 0.7250),
    (Manner.PUSH, 'lemon'): (0.5750, 0.6750, 0.6750),
    (Manner.PUSH, 'chicken'): (0.7250, 0.8000, 0.8000),
}
#: The one cell that contradicts the paper's rule and data: the interactive mode does not depend on
#: the manner of the demonstration, so the cell must equal the place row, 0.8250.
MISPRINT = (Manner.PUSH, 'pear', Mode.INTERACTIVE)


class Table1(NamedTuple):
    """The table.

    Attributes:
        manners: of the demonstrations, along the first axis.
        objects: names along the second axis.
        success: shape [manner, object, mode], modes as in MODES.
    """

    manners: tuple[Manner, ...]
    objects: tuple[str, ...]
    success: FloatArray


def table1(model: RobotModel, world: World, threshold: float = 0.5) -> Table1:
    """Compute the table by the transition probabilities, as the paper does.

    A human who is asked always succeeds. The goal is taken as inferred.
    """
    objects = tuple(model.objects)
    success = np.array(
        [
            [
                [_mean_success(model, world, o, m, mode, threshold) for mode in MODES]
                for o in objects
            ]
            for m in world.manners
        ]
    )
    return Table1(world.manners, objects, success)


def _mean_success(
    model: RobotModel, world: World, name: str, manner: Manner, mode: Mode, threshold: float
) -> float:
    shown = [
        _success(model, world, name, *change, manner, mode, threshold)
        for change in changes_of(world)
        if world.action_of(manner, change[1]) is not None
    ]
    return float(np.mean(shown))


def _success(
    model: RobotModel,
    world: World,
    name: str,
    x_i: State,
    x_f: State,
    manner: Manner,
    mode: Mode,
    threshold: float,
) -> float:
    known = model.goal_model(name)
    goal = map_goal(known.goal_posterior(x_i, x_f), x_f)
    made = choose(known, x_i, goal, world.action_of(manner, x_f), mode, threshold)
    if made.kind is Kind.ASK_HUMAN:
        return float(goal == x_f)
    return made.predicted[x_f] if made.predicted else 0.0
