"""The interesting demonstrations: the state changes, and the object was not OFFTABLE before."""

from __future__ import annotations

from typing import NamedTuple

from likeme_core.tabletop import State
from likeme_inference.tabletop.domain import OUT_OF_REACH
from likeme_inference.tabletop.robot_model import RobotModel


class StateChange(NamedTuple):
    """An object and its change of state."""

    object: str
    x_i: State
    x_f: State


#: LEFT to RIGHT, LEFT to OFFTABLE, RIGHT to LEFT, RIGHT to OFFTABLE: the columns of Fig 8.
CHANGES = tuple(
    (x_i, x_f) for x_i in State if x_i not in OUT_OF_REACH for x_f in State if x_f != x_i
)


def interesting(model: RobotModel) -> list[StateChange]:
    """All of them, object by object."""
    return [StateChange(name, *change) for name in model.objects for change in CHANGES]
