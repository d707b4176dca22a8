"""Named states, actions and goals of the discrete model (Methods, Case II)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Domain:
    """The sets Omega_X, Omega_A and Omega_G; domain.TABLETOP is the paper's.

    States, actions and goals are numbered by their position; arrays are indexed by those numbers.

    Attributes:
        states: names of the values of X_i and X_f.
        actions: names of the values of A.
        goals: name -> names of the states that fulfil it; by default each state is a goal.
        aims: action -> goal it is aimed at; only decides ties. May be partial.
        out_of_reach: states from which the robot cannot move an object.
    """

    states: tuple[str, ...]
    actions: tuple[str, ...]
    goals: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    aims: Mapping[str, str] = field(default_factory=dict)
    out_of_reach: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        object.__setattr__(self, 'states', tuple(self.states))
        object.__setattr__(self, 'actions', tuple(self.actions))
        for given in (*self.goals.values(), self.out_of_reach, self.states, self.actions):
            if isinstance(given, str):
                raise ValueError(f'Expected names in a tuple or a set, got the name {given!r}.')
        goals = {g: tuple(s) for g, s in self.goals.items()} or {s: (s,) for s in self.states}
        object.__setattr__(self, 'goals', MappingProxyType(goals))
        object.__setattr__(self, 'aims', MappingProxyType(dict(self.aims)))
        object.__setattr__(self, 'out_of_reach', frozenset(self.out_of_reach))
        _check_names('state', self.states)
        _check_names('action', self.actions)
        for states in goals.values():
            if not states:
                raise ValueError('Expected at least one state that fulfils each goal, got none.')
            _check_known('state', states, self.states)
        _check_known('action', self.aims, self.actions)
        _check_known('goal', self.aims.values(), goals)
        _check_known('state', self.out_of_reach, self.states)

    def __eq__(self, other: object) -> bool:
        """Whether names and their order agree."""
        return isinstance(other, Domain) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    def __reduce__(self) -> tuple[type[Domain], tuple[object, ...]]:
        """Pickle by the arguments, as mapping proxies cannot be pickled."""
        goals, aims = dict(self.goals), dict(self.aims)
        return Domain, (self.states, self.actions, goals, aims, self.out_of_reach)

    @cached_property
    def _key(self) -> tuple[object, ...]:
        goals, aims = tuple(self.goals.items()), frozenset(self.aims.items())
        return self.states, self.actions, goals, aims, self.out_of_reach

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of transition[x_i, a, x_f] and of its counts."""
        return len(self.states), len(self.actions), len(self.states)

    @cached_property
    def goal_matrix(self) -> NDArray[np.float64]:
        """Which states fulfil which goals: 1 or 0, shape [g, x_f], read-only."""
        matrix = np.array(
            [
                [float(s in fulfilling) for s in self.states]
                for fulfilling in map(frozenset, self.goals.values())
            ]
        )
        matrix.flags.writeable = False
        return matrix

    @cached_property
    def stuck(self) -> NDArray[np.bool_]:
        """Whether a state is out of reach, shape [x], read-only."""
        stuck = np.array([state in self.out_of_reach for state in self.states])
        stuck.flags.writeable = False
        return stuck

    @cached_property
    def aimed(self) -> tuple[tuple[int, ...], ...]:
        """Goal -> numbers of the actions aimed at it."""
        return tuple(
            tuple(i for i, a in enumerate(self.actions) if self.aims.get(a) == goal)
            for goal in self.goals
        )

    @cached_property
    def state_aims(self) -> tuple[int, ...]:
        """Number of the state that each action is aimed at.

        Raises:
            ValueError: an action is aimed at no goal, or at one that is no single state.
        """
        if not self.aimed_at_states:
            raise ValueError('Expected every action aimed at a state, got one that is not.')
        return tuple(self.states.index(self.aims[action]) for action in self.actions)

    @property
    def aimed_at_states(self) -> bool:
        """Whether every action is aimed at a goal of a single state, its name."""
        targets = [self.aims.get(action) for action in self.actions]
        return all(self.goals.get(goal or '') == (goal,) for goal in targets)

    def state(self, name: str) -> int:
        """Number of a state."""
        return _number('state', name, self.states)

    def action(self, name: str) -> int:
        """Number of an action."""
        return _number('action', name, self.actions)

    def goal(self, name: str) -> int:
        """Number of a goal."""
        return _number('goal', name, tuple(self.goals))


def _number(what: str, name: str, names: tuple[str, ...]) -> int:
    if name not in names:
        raise ValueError(_expected(what, name, names))
    return names.index(name)


def _expected(what: str, name: str, names: Iterable[str]) -> str:
    return f'Expected one of the {what}s {", ".join(names)}, got {name!r}.'


def _check_names(what: str, names: tuple[str, ...]) -> None:
    if not names or len(set(names)) != len(names) or not all(names):
        raise ValueError(f'Expected at least one {what}, each named once, got {list(names)}.')


def _check_known(what: str, used: Iterable[str], known: Iterable[str]) -> None:
    names = dict.fromkeys(known)
    for name in used:
        if name not in names:
            raise ValueError(_expected(what, name, names))
