"""Exploration policies: systematic (the paper's), random, and by information gain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from likeme_core.world import World
from likeme_inference.experience.trial import Counts, Pair
from likeme_inference.tabletop.active_exploration import information_gain
from likeme_inference.tabletop.domain import domain_of
from likeme_inference.tabletop.shared_prior import fit_weights, shared_prior


class ExplorationPolicy(Protocol):
    """Chooses the next pair to try.

    Attributes:
        adaptive: whether the choice depends on the final states of trials, not only on their
            number; trials are then made one after another.
    """

    @property
    def adaptive(self) -> bool:
        """See the class."""

    def next(self, world: World, counts: Counts, rng: np.random.Generator) -> Pair | None:
        """The next pair given the counts; None when done."""


@dataclass(frozen=True)
class Systematic:
    """Every pair equally often, as in the paper; in rounds, in random order within each.

    Attributes:
        repetitions: trials of each pair.
    """

    repetitions: int = 10
    adaptive: bool = False

    def next(self, world: World, counts: Counts, rng: np.random.Generator) -> Pair | None:
        """A random one of the pairs with the fewest trials."""
        tried = {pair: _tried(counts, pair) for pair in pairs_of(world, counts)}
        least = min(tried.values(), default=self.repetitions)
        if least >= self.repetitions:
            return None
        return _drawn([pair for pair, trials in tried.items() if trials == least], rng)


@dataclass(frozen=True)
class Random:
    """A random action from a random initial state, of a random object.

    Attributes:
        trials: in total.
    """

    trials: int = 540
    adaptive: bool = False

    def next(self, world: World, counts: Counts, rng: np.random.Generator) -> Pair | None:
        """A random pair."""
        if sum(int(table.sum()) for table in counts.values()) >= self.trials:
            return None
        return _drawn(pairs_of(world, counts), rng)


@dataclass(frozen=True)
class InformationGain:
    """The pair whose trial is expected to improve the robot's plans most.

    Attributes:
        trials: in total.
    """

    trials: int = 135
    adaptive: bool = True

    def next(self, world: World, counts: Counts, rng: np.random.Generator) -> Pair | None:
        """The pair of greatest `information_gain`; a random one of ties."""
        if sum(int(table.sum()) for table in counts.values()) >= self.trials:
            return None
        tables = np.array(list(counts.values()), dtype=np.float64)
        domain = domain_of(world)
        aims = domain.state_aims
        prior = shared_prior(tables, fit_weights(tables, aims, rounds=3), aims)
        gain = information_gain(tables + prior, rng, domain=domain)
        pairs = [pair for pair in pairs_of(world, counts) if pair.x_i not in world.out_of_reach]
        index = {name: o for o, name in enumerate(counts)}
        gains = np.array([gain[index[p.object], p.x_i, p.action] for p in pairs])
        best = np.flatnonzero(gains >= gains.max())
        return _drawn([pairs[i] for i in best], rng)


def pairs_of(world: World, counts: Counts) -> list[Pair]:
    """All combinations of object, initial state and action."""
    return [Pair(name, x_i, a) for name in counts for x_i in world.states for a in world.actions]


def _tried(counts: Counts, pair: Pair) -> int:
    return int(counts[pair.object][pair.x_i, pair.action].sum())


def _drawn(pairs: list[Pair], rng: np.random.Generator) -> Pair:
    return pairs[int(rng.integers(len(pairs)))]
