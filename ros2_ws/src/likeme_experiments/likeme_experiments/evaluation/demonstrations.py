"""The interesting demonstrations: the state changes, and the robot reaches where it was before."""

from __future__ import annotations

from typing import NamedTuple

from likeme_core.tabletop import State
from likeme_core.world import World
from likeme_inference.tabletop.robot_model import RobotModel


class StateChange(NamedTuple):
    """An object and its change of state."""

    object: str
    x_i: State
    x_f: State


def changes_of(world: World) -> tuple[tuple[State, State], ...]:
    """All changes from states within reach: in the paper's world the four columns of Fig 8."""
    return tuple(
        (x_i, x_f)
        for x_i in world.states
        if x_i not in world.out_of_reach
        for x_f in world.states
        if x_f != x_i
    )


def interesting(model: RobotModel, world: World) -> list[StateChange]:
    """All of them, object by object."""
    return [StateChange(name, *change) for name in model.objects for change in changes_of(world)]
