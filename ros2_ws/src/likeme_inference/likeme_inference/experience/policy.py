"""Which pair to try next: the paper's way, by chance, and where decisions would gain most."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from likeme_core.tabletop import Action, State
from likeme_inference.experience.trial import Counts, Pair
from likeme_inference.tabletop.domain import OUT_OF_REACH
from likeme_inference.tabletop.exploration import information_gain
from likeme_inference.tabletop.shared_prior import fitted, shared_prior


class Policy(Protocol):
    """Chooses what to try.

    Attributes:
        adaptive: whether the choice hangs on how trials ended, not only on how many there were. If
            it does, trials are made one after another.
    """

    @property
    def adaptive(self) -> bool:
        """See the class."""

    def next(self, counts: Counts, rng: np.random.Generator) -> Pair | None:
        """The pair to try after trials that ended as counted; None when there is no more to do."""


@dataclass(frozen=True)
class Systematic:
    """Every pair equally often, the paper's way; in rounds, in random order within each.

    Attributes:
        repetitions: trials of each pair.
    """

    repetitions: int = 10
    adaptive: bool = False

    def next(self, counts: Counts, rng: np.random.Generator) -> Pair | None:
        """One of the pairs that were tried least often."""
        tried = {pair: _tried(counts, pair) for pair in pairs_of(counts)}
        least = min(tried.values(), default=self.repetitions)
        if least >= self.repetitions:
            return None
        return _drawn([pair for pair, trials in tried.items() if trials == least], rng)


@dataclass(frozen=True)
class Random:
    """A random action from a random initial state, of a random object.

    Attributes:
        trials: in all.
    """

    trials: int = 540
    adaptive: bool = False

    def next(self, counts: Counts, rng: np.random.Generator) -> Pair | None:
        """Any pair."""
        if sum(int(table.sum()) for table in counts.values()) >= self.trials:
            return None
        return _drawn(pairs_of(counts), rng)


@dataclass(frozen=True)
class InformationGain:
    """The pair by whose trial the robot's plans are expected to gain most.

    Attributes:
        trials: in all.
    """

    trials: int = 135
    adaptive: bool = True

    def next(self, counts: Counts, rng: np.random.Generator) -> Pair | None:
        """The pair that `information_gain` puts first; among equals by chance."""
        if sum(int(table.sum()) for table in counts.values()) >= self.trials:
            return None
        tables = np.array(list(counts.values()), dtype=np.float64)
        prior = shared_prior(tables, fitted(tables, rounds=3))
        gain = information_gain(tables + prior, rng)
        pairs = [pair for pair in pairs_of(counts) if pair.x_i not in OUT_OF_REACH]
        index = {name: o for o, name in enumerate(counts)}
        gains = np.array([gain[index[p.object], p.x_i, p.action] for p in pairs])
        best = np.flatnonzero(gains >= gains.max())
        return _drawn([pairs[i] for i in best], rng)


def pairs_of(counts: Counts) -> list[Pair]:
    """Every object, initial state and action."""
    return [Pair(name, x_i, a) for name in counts for x_i in State for a in Action]


def _tried(counts: Counts, pair: Pair) -> int:
    return int(counts[pair.object][pair.x_i, pair.action].sum())


def _drawn(pairs: list[Pair], rng: np.random.Generator) -> Pair:
    return pairs[int(rng.integers(len(pairs)))]
