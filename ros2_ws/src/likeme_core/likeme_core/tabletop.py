"""States, actions and modes of the tabletop task. A world file defines which there are.

States and actions are integers, their numbers in their world, so that they index arrays; they know
their names. likeme_msgs carries the numbers, and the topic `world` says what they mean.
"""

from __future__ import annotations

from enum import IntEnum, StrEnum
from typing import Any, NamedTuple


class State(int):
    """Region of an object: a value of X_i, X_f or G.

    Attributes:
        name: in the world file.
    """

    name: str

    def __new__(cls, number: int, name: str) -> State:
        """number: position in the world's list of regions."""
        state = super().__new__(cls, number)
        state.name = name
        return state

    def __reduce__(self) -> tuple[type[State], tuple[Any, ...]]:
        return State, (int(self), self.name)

    def __repr__(self) -> str:
        return self.name

    __str__ = __repr__


class Handling(NamedTuple):
    """What a manner does with the object.

    Attributes:
        grasped: whether it is lifted, rather than slid on the table.
        past, doing: the manner as people tell it, 'placed' and 'placing'.
        fall: height of the grasp point above the table from which a lifted object is let fall, m;
            0: it is set down.
    """

    grasped: bool
    past: str
    doing: str
    fall: float = 0.0


class Manner(IntEnum):
    """How an object is moved.

    PLACE lifts it and sets it down, PUSH slides it on the table, DROP lifts it and lets it fall.
    """

    PLACE = 0
    PUSH = 1
    DROP = 2

    @property
    def handling(self) -> Handling:
        """What robot and person do, and what perception tells the manner by."""
        return _HANDLING[self]


_HANDLING = {
    Manner.PLACE: Handling(grasped=True, past='placed', doing='placing'),
    Manner.PUSH: Handling(grasped=False, past='pushed', doing='pushing'),
    Manner.DROP: Handling(grasped=True, past='dropped', doing='dropping', fall=0.24),
}


class Action(int):
    """An action of the robot: a value of A (paper, section Robot Action).

    Attributes:
        name: in the world file.
        manner: how it moves an object.
        target: the state it aims at.
    """

    name: str
    manner: Manner
    target: State

    def __new__(cls, number: int, name: str, manner: Manner, target: State) -> Action:
        """number: position in the world's list of actions."""
        action = super().__new__(cls, number)
        action.name, action.manner, action.target = name, manner, target
        return action

    def __reduce__(self) -> tuple[type[Action], tuple[Any, ...]]:
        return Action, (int(self), self.name, self.manner, self.target)

    def __repr__(self) -> str:
        return self.name

    __str__ = __repr__


class Mode(StrEnum):
    """How a demonstration is imitated: the three columns of Table 1, and several actions."""

    TRAJECTORY = 'trajectory'
    GOAL_BASED = 'goal_based'
    INTERACTIVE = 'interactive'
    SEQUENTIAL = 'sequential'
