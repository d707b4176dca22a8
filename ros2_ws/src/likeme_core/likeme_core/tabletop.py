"""States, actions and modes of the tabletop task, with the numbers of the authors' data.

The constants of likeme_msgs/ObjectState, Demonstration and ExecuteAction have the same names and
numbers.
"""

from __future__ import annotations

from enum import IntEnum, StrEnum


class State(IntEnum):
    """Where an object is: a value of X_i, X_f or G. LEFT is the robot's left, y > 0."""

    LEFT = 0
    RIGHT = 1
    OFFTABLE = 2


class Manner(IntEnum):
    """How an object is moved: lifted and put down, or slid along the table."""

    PLACE = 0
    PUSH = 1


class Action(IntEnum):
    """The robot's six actions: a value of A (paper, section Robot Action)."""

    PLACE_LEFT = 0
    PLACE_RIGHT = 1
    PLACE_OFFTABLE = 2
    PUSH_LEFT = 3
    PUSH_RIGHT = 4
    PUSH_OFFTABLE = 5

    @property
    def target(self) -> State:
        """The state the action aims at."""
        return State(self % len(State))

    @property
    def manner(self) -> Manner:
        """Whether the action places or pushes."""
        return Manner(self // len(State))

    @classmethod
    def of(cls, manner: Manner, target: State) -> Action:
        """Compose an action of manner and target."""
        return cls(manner * len(State) + target)


class Mode(StrEnum):
    """How a demonstration is imitated: the three columns of Table 1, and acting more than once."""

    TRAJECTORY = 'trajectory'
    GOAL_BASED = 'goal_based'
    INTERACTIVE = 'interactive'
    SEQUENTIAL = 'sequential'
