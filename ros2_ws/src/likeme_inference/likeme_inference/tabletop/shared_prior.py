"""A Dirichlet prior that the trials themselves choose, shared by all objects (empirical Bayes).

alpha[object, x_i, a, x_f] = aimed_prior(stay, aimed, elsewhere) + share * trials of other objects.

What an action does to one object is a weak hint of what it does to another; how weak, and how much
an action does what it is meant for, is found by the marginal likelihood of the trials at hand. The
starting numbers are no world's: one trial's worth each for staying and for what is aimed at, a
tenth for the rest and of every other object's trial; each may move about a factor e (log-normal).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import gammaln

from likeme_core.tabletop import Action
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.dirichlet import aimed_prior

#: Factors by which the search moves one number at a time.
STEPS = (2.0, 1.3)
_AIMS = tuple(int(action.target) for action in Action)
_STAY, _AIMED, _ELSEWHERE = (
    aimed_prior(3, _AIMS, *(float(i == j) for j in range(3))) for i in range(3)
)


class Weights(NamedTuple):
    """Numbers of the prior; each a float or an array over leading axes (seeds)."""

    stay: FloatArray
    aimed: FloatArray
    elsewhere: FloatArray
    share: FloatArray


START = Weights(*(np.asarray(w) for w in (1.0, 1.0, 0.1, 0.1)))


def shared_prior(counts: FloatArray, weights: Weights) -> FloatArray:
    """Pseudo-counts for counts[..., object, x_i, a, x_f], of the same shape."""
    stay, aimed, elsewhere, share = (np.asarray(w)[..., None, None, None, None] for w in weights)
    others = counts.sum(axis=-4, keepdims=True) - counts
    own = stay * _STAY + aimed * _AIMED + elsewhere * _ELSEWHERE
    return np.asarray(own + share * others)


def fitted(counts: FloatArray, start: Weights = START, rounds: int = 1) -> Weights:
    """The weights after `rounds` of coordinate search from `start`.

    counts: [..., object, x_i, a, x_f]; a search for each of the leading axes.
    """
    lead = counts.shape[:-4]
    weights = Weights(*(np.array(np.broadcast_to(w, lead)) for w in start))
    best = _log_posterior(counts, weights)
    for _ in range(rounds):
        for step in STEPS:
            for name in Weights._fields:
                for factor in (step, 1 / step):
                    weights, best = _moved(counts, weights, best, name, factor)
    return weights


def _moved(
    counts: FloatArray, weights: Weights, best: FloatArray, name: str, factor: float
) -> tuple[Weights, FloatArray]:
    """Move one number where that makes the trials more likely."""
    tried = weights._replace(**{name: getattr(weights, name) * factor})
    score = _log_posterior(counts, tried)
    better = score > best
    kept = Weights(*(np.where(better, n, o) for n, o in zip(tried, weights, strict=True)))
    return kept, np.asarray(np.where(better, score, best))


def _log_posterior(counts: FloatArray, weights: Weights) -> FloatArray:
    alpha = shared_prior(counts, weights)
    total, trials = alpha.sum(axis=-1), counts.sum(axis=-1)
    rows = (gammaln(alpha + counts) - gammaln(alpha)).sum(axis=-1)
    rows = rows - gammaln(total + trials) + gammaln(total)
    away = sum(np.log(w / s) ** 2 / 2 for w, s in zip(weights, START, strict=True))
    return np.asarray(rows.sum(axis=(-1, -2, -3)) - away)
