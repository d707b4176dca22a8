"""A tabletop world as a Domain, and the two variants of the policy."""

from __future__ import annotations

from enum import StrEnum
from functools import cache

from likeme_core.world import World, load_world
from likeme_inference.tabletop.finite_domain import Domain


class Policy(StrEnum):
    """The paper's two variants of P(A | G, X_i) (Methods, Goal inference)."""

    #: P(A | X_i, X_f = g) of the learned transition model; used for the paper's tables.
    DIRECT = 'direct'
    #: The limit of goal-based exploration, see goal_exploration.py.
    EXPLORED = 'explored'


@cache
def domain_of(world: World) -> Domain:
    """The states and actions of a world as a Domain. Goals are states."""
    return Domain(
        states=tuple(state.name for state in world.states),
        actions=tuple(action.name for action in world.actions),
        aims={action.name: action.target.name for action in world.actions},
        out_of_reach=frozenset(state.name for state in world.out_of_reach),
    )


#: The paper's tabletop, in which model files without further lines are.
TABLETOP = domain_of(load_world())
