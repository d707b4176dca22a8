"""Robots that learned from 10 trials a pair in the real robot's table, and the tasks they get."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop import StructuredPrior, maximum_likelihood, shipped
from likeme_inference.tabletop.arrays import FloatArray, IntArray
from likeme_inference.tabletop.shared_prior import fit_weights, shared_prior

#: Trials of each pair.
TRIALS = 10
MODEL = shipped()
#: The table: relative frequencies of the 540 trials, shape [object, x_i, a, x_f].
TABLE = np.array([known.transition for known in MODEL.objects.values()])
_OPEN = np.flatnonzero(~MODEL.domain.stuck)
#: Object, x_i and goal of the 12 changes, each of shape [task].
OBJECT, X_I, GOAL = np.array(
    [(o, x, g) for o in range(len(TABLE)) for x in _OPEN for g in range(3) if g != x]
).T


class Learned(NamedTuple):
    """Pseudo-counts of a robot's trials by three estimates, shape [object, x_i, a, x_f]."""

    frequencies: FloatArray
    shared: FloatArray
    structured: FloatArray


@cache
def robots(number: int, seed: int) -> tuple[Learned, ...]:
    """Robots whose trials are drawn from the table (a parametric bootstrap)."""
    return tuple(_robots(number, seed))


def _robots(number: int, seed: int) -> Iterator[Learned]:
    for run in range(number):
        counts = trials(TABLE, TRIALS, np.random.default_rng([seed, run]))
        aims = MODEL.domain.state_aims
        shared = shared_prior(counts, fit_weights(counts, aims, rounds=3), aims)
        structured = StructuredPrior.of(counts, MODEL.domain).pseudo_counts
        yield Learned(counts, counts + shared, counts + structured)


def trials(world: FloatArray, number: int, rng: np.random.Generator) -> FloatArray:
    """Counts of `number` trials of each pair in a world."""
    return rng.multinomial(number, world).astype(np.float64)


def best_actions(pseudo_counts: FloatArray) -> tuple[IntArray, FloatArray]:
    """The action of greatest predicted success in each task, and that success; shape [task]."""
    success = maximum_likelihood(pseudo_counts)[OBJECT, X_I, :, GOAL]
    action = success.argmax(axis=-1)
    return action, success[np.arange(len(action)), action]
