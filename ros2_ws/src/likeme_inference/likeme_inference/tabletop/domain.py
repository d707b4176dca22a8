"""The paper's tabletop task as a Domain, and the two variants of the policy."""

from __future__ import annotations

from enum import StrEnum

from likeme_core.tabletop import Action, State
from likeme_inference.tabletop.finite_domain import Domain


class Policy(StrEnum):
    """The paper's two variants of P(A | G, X_i) (Methods, Goal inference)."""

    #: P(A | X_i, X_f = g) of the learned transition model; used for the paper's tables.
    DIRECT = 'direct'
    #: The limit of goal-based exploration, see goal_exploration.py.
    EXPLORED = 'explored'


#: States from which the robot cannot move an object ("our current implementation does not allow
#: the robot to pick up objects that are located OFFTABLE").
OUT_OF_REACH = frozenset({State.OFFTABLE})

#: The paper's tabletop. Goals are states.
TABLETOP = Domain(
    states=tuple(state.name for state in State),
    actions=tuple(action.name for action in Action),
    aims={action.name: action.target.name for action in Action},
    out_of_reach=frozenset(state.name for state in OUT_OF_REACH),
)
