"""The paper's tabletop task as a Domain, and the two variants of its policy."""

from __future__ import annotations

from enum import StrEnum

from likeme_core.tabletop import Action, State
from likeme_inference.tabletop.spaces import Domain


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
