"""The next step of a campaign on a real table, so that people are asked least to set it up.

Costs are in resets by people: a reset costs 1, a motion of the robot MOTION_COST. The cost of an
object being in state x, while trials of it are wanted from the states W, is

    V(x) = 0 for x in W, else min(1, min over a of MOTION_COST + sum over x_f of
           p(x_f | x, a) V(x_f)),

with p learned from the trials so far. States that the robot cannot reach into are in W only when
nothing else is wanted: an object gets there by itself, and only a person brings it back.

A wanted trial that ends out of reach is followed by a reset whenever it is made. So trials that
keep the cost low come first, people are asked when the robot can do nothing more, and then for all
objects at once.

What failed and left the object where it was will probably fail there again, and is hardly another
sample of p(x_f | x_i, a): such a trial comes last, and is not made to bring the object somewhere.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_core.tabletop import State
from likeme_core.world import World
from likeme_inference.experience.trial import Counts, Pair
from likeme_inference.tabletop.arrays import BoolArray, FloatArray
from likeme_inference.tabletop.domain import domain_of
from likeme_inference.tabletop.shared_prior import START, shared_prior
from likeme_inference.tabletop.transition_model import maximum_likelihood

#: People's resets that a motion of the robot is worth.
MOTION_COST = 0.1
#: Expected increase of the cost from which on a trial waits for those that are cheaper.
LIKELY = 0.25
#: Bound of the value iteration, and the change at which it ends.
ITERATIONS, CONVERGED = 200, 1e-6


class Reset(NamedTuple):
    """An object that a person is to put into a state."""

    object: str
    state: State


class TrialStep(NamedTuple):
    """The robot makes a trial; wanted False: to bring the object to where trials are wanted."""

    pair: Pair
    wanted: bool


class ResetStep(NamedTuple):
    """A person is asked, once, for these resets."""

    resets: tuple[Reset, ...]


@dataclass(frozen=True)
class TrialsWanted:
    """What is missing of a campaign, and what is known where.

    Attributes:
        missing: object -> trials that are wanted, shape [x_i, a].
        seen: object -> its state; None: not known.
        counts: object -> trials so far, shape [x_i, a, x_f]; p(x_f | x_i, a) is learned from them.
        blocked: pairs that cannot be tried as the table is, e.g. another object is in the way.
        in_vain: pairs that left their object where it still is.
        left: resets that nobody makes at present.
    """

    missing: Mapping[str, NDArray[np.int64]]
    seen: Mapping[str, State | None]
    counts: Counts
    blocked: frozenset[Pair] = frozenset()
    in_vain: frozenset[Pair] = frozenset()
    left: frozenset[Reset] = frozenset()


def next_step(
    world: World, wanted: TrialsWanted, rng: np.random.Generator
) -> TrialStep | ResetStep | None:
    """The next trial, or the resets to ask for; None: nothing is missing, or all of it is left.

    rng: draws among trials that are equally good.
    """
    learned = learned_transition(world, wanted.counts)
    tables = [
        _ObjectPlan(world, wanted, name, learned[name])
        for name, missing in wanted.missing.items()
        if missing.any()
    ]
    at_hand = [candidate for table in tables for candidate in table.at_hand()]
    if at_hand:
        drawn = rng.permutation(len(at_hand))
        best = min(range(len(at_hand)), key=lambda i: (*at_hand[i][:3], drawn[i]))
        return TrialStep(at_hand[best].pair, wanted=True)
    transports = [(table.cost_here, table) for table in tables if table.cost_here < 1]
    if transports:
        return TrialStep(min(transports, key=lambda each: each[0])[1].transport(), wanted=False)
    resets = tuple(reset for table in tables if (reset := table.reset()) is not None)
    return ResetStep(resets) if resets else None


def learned_transition(world: World, counts: Counts) -> dict[str, FloatArray]:
    """Object -> mean p(x_f | x_i, a) of the prior shared by all objects, and their trials."""
    if not counts:
        return {}
    tables = np.array(list(counts.values()), dtype=np.float64)
    prior = shared_prior(tables, START, domain_of(world).state_aims)
    return dict(zip(counts, maximum_likelihood(tables + prior), strict=True))


def reset_costs(wanted: BoolArray, transition: FloatArray, possible: BoolArray) -> FloatArray:
    """V(x), see the module; shape [x].

    Args:
        wanted: whether trials are wanted from a state, shape [x].
        transition: p(x_f | x, a), shape [x, a, x_f].
        possible: whether the robot can do an action there, shape [x, a].
    """
    cost = np.where(wanted, 0.0, 1.0)
    for _ in range(ITERATIONS):
        moved = motion_costs(cost, transition, possible).min(axis=-1)
        new = np.where(wanted, 0.0, np.minimum(moved, 1.0))
        if np.abs(new - cost).max() < CONVERGED:
            break
        cost = new
    return cost


def motion_costs(cost: FloatArray, transition: FloatArray, possible: BoolArray) -> FloatArray:
    """Expected cost of one motion and what follows, shape [x, a]; infinite if it is impossible."""
    return np.where(possible, MOTION_COST + transition @ cost, np.inf)


class _Candidate(NamedTuple):
    """A wanted trial at hand, ordered by the first three fields.

    Attributes:
        in_vain: see TrialsWanted.
        costly: whether the expected increase of the cost is above LIKELY.
        tried: trials of the pair so far.
    """

    in_vain: bool
    costly: bool
    tried: int
    pair: Pair


class _ObjectPlan:
    """What can be done with one object of which trials are wanted."""

    def __init__(
        self, world: World, wanted: TrialsWanted, name: str, transition: FloatArray
    ) -> None:
        self._world, self._name, self._transition = world, name, transition
        self._missing, self._seen = wanted.missing[name], wanted.seen[name]
        self._tried = wanted.counts[name].sum(axis=-1)
        self._left, self._in_vain = wanted.left, wanted.in_vain
        self._free = self._without(wanted.blocked)
        self._within_reach = np.array([s not in world.out_of_reach for s in world.states])
        self._goals = self._goals_of((self._missing > 0) & self._free)
        movable = self._free & self._without(wanted.in_vain)
        self._possible = np.asarray(movable & self._within_reach[:, None])
        self._cost = self._costs(self._goals)

    @property
    def cost_here(self) -> float:
        """V of the state that the object is seen in."""
        return 1.0 if self._seen is None else float(self._cost[self._seen])

    def at_hand(self) -> list[_Candidate]:
        """The wanted trials that can be made as the table is."""
        return [] if self._seen is None else self._candidates(self._seen, self._free[self._seen])

    def transport(self) -> Pair:
        """The action that is expected to bring the object to where trials are wanted."""
        assert self._seen is not None, 'An object whose state is unknown is not moved.'
        costs = motion_costs(self._cost, self._transition, self._possible)
        action = self._world.actions[int(costs[self._seen].argmin())]
        return Pair(self._name, self._seen, action)

    def reset(self) -> Reset | None:
        """The state to ask a person for: of the cheapest trials, then of the most."""
        # A person makes room, too.
        goals = self._goals_of(self._missing > 0)
        states = [s for s in self._world.states if goals[s] and self._open(s)]
        if not states:
            return None
        every = np.ones(len(self._world.actions), dtype=bool)

        def rank(state: State) -> tuple[bool, int, int]:
            cheapest = min(candidate.costly for candidate in self._candidates(state, every))
            return cheapest, -int(self._missing[state].sum()), state

        return Reset(self._name, min(states, key=rank))

    def _open(self, state: State) -> bool:
        return Reset(self._name, state) not in self._left

    def _candidates(self, x_i: State, among: BoolArray) -> list[_Candidate]:
        found = []
        for action in self._world.actions:
            if self._missing[x_i, action] and among[action]:
                costly = self._increase(x_i, action) > LIKELY
                tried = int(self._tried[x_i, action])
                pair = Pair(self._name, x_i, action)
                found.append(_Candidate(pair in self._in_vain, costly, tried, pair))
        return found

    def _increase(self, x_i: State, action: int) -> float:
        """How much the cost is expected to grow by a wanted trial."""
        if not self._within_reach[x_i]:
            return 0.0
        after = self._missing.copy()
        after[x_i, action] -= 1
        if not after.any():
            return 0.0
        goals = self._goals_of((after > 0) & self._free)
        cost = self._cost if (goals == self._goals).all() else self._costs(goals)
        return float(self._transition[x_i, action] @ cost - cost[x_i])

    def _without(self, pairs: Iterable[Pair]) -> BoolArray:
        """False for the object's pairs among these, shape [x_i, a]."""
        kept = np.ones(self._missing.shape, dtype=bool)
        for name, x_i, action in pairs:
            if name == self._name:
                kept[x_i, action] = False
        return kept

    def _costs(self, goals: BoolArray) -> FloatArray:
        return reset_costs(goals, self._transition, self._possible)

    def _goals_of(self, wanted: BoolArray) -> BoolArray:
        """Of wanted pairs [x_i, a]: the states W; those out of reach if there is no other."""
        states = wanted.any(axis=-1)
        within = states & self._within_reach
        return np.asarray(within if within.any() else states)
