"""The words of the tabletop task, with the numbers of the messages and of the authors' data."""

from __future__ import annotations

from enum import IntEnum, StrEnum

from likeme_inference.tabletop.spaces import Domain


class State(IntEnum):
    """Where an object is: a value of X_i, X_f or G. LEFT is the robot's left."""

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


class Policy(StrEnum):
    """Where P(A | G, X_i) comes from: the paper's two variants (Methods, Goal inference)."""

    #: P(A | X_i, X_f = g), planned on the learned transition model; the paper's tables follow it.
    DIRECT = 'direct'
    #: What practising such plans converges to (goal-based exploration).
    EXPLORED = 'explored'


#: States out of which the robot cannot take an object ("our current implementation does not allow
#: the robot to pick up objects that are located OFFTABLE").
OUT_OF_REACH = frozenset({State.OFFTABLE})

#: The paper's table as a Domain. Goals are states.
TABLETOP = Domain(
    states=tuple(state.name for state in State),
    actions=tuple(action.name for action in Action),
    aims={action.name: action.target.name for action in Action},
    out_of_reach=frozenset(state.name for state in OUT_OF_REACH),
)
