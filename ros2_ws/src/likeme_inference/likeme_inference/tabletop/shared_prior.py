"""A Dirichlet prior shared by all objects and fitted to their trials (empirical Bayes).

alpha[object, x_i, a, x_f] = aimed_prior(stay, aimed, elsewhere) + share * trials of other objects.

The four weights maximise the marginal likelihood of the trials times a log-normal prior (standard
deviation 1) around the start values: one pseudo-count each for the initial and the target state,
0.1 for other states, and 0.1 per trial of another object.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.dirichlet import aimed_prior

#: Factors of the coordinate search.
STEPS = (2.0, 1.3)


class PriorWeights(NamedTuple):
    """Weights of the prior; each a scalar or an array over leading axes (seeds)."""

    stay: FloatArray
    aimed: FloatArray
    elsewhere: FloatArray
    share: FloatArray


START = PriorWeights(*(np.asarray(w) for w in (1.0, 1.0, 0.1, 0.1)))


def shared_prior(counts: FloatArray, weights: PriorWeights, aims: tuple[int, ...]) -> FloatArray:
    """Pseudo-counts for counts[..., object, x_i, a, x_f], of the same shape.

    aims: target state of each action, shape [a].
    """
    stay, aimed, elsewhere, share = (np.asarray(w)[..., None, None, None, None] for w in weights)
    others = counts.sum(axis=-4, keepdims=True) - counts
    stays, aimed_at, rest = _patterns(counts.shape[-1], aims)
    own = stay * stays + aimed * aimed_at + elsewhere * rest
    return np.asarray(own + share * others)


@cache
def _patterns(states: int, aims: tuple[int, ...]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where a transition stays, reaches the aim, or does neither: 1 or 0, shape [x_i, a, x_f]."""
    stays, aimed, elsewhere = (
        aimed_prior(states, aims, *(float(i == j) for j in range(3))) for i in range(3)
    )
    return stays, aimed, elsewhere


def fit_weights(
    counts: FloatArray, aims: tuple[int, ...], start: PriorWeights = START, rounds: int = 1
) -> PriorWeights:
    """The weights after `rounds` of coordinate search from `start`.

    counts: [..., object, x_i, a, x_f]; one search per element of the leading axes.
    """
    lead = counts.shape[:-4]
    weights = PriorWeights(*(np.array(np.broadcast_to(w, lead)) for w in start))
    best = _log_posterior(counts, weights, aims)
    for _ in range(rounds):
        for step in STEPS:
            for name in PriorWeights._fields:
                for factor in (step, 1 / step):
                    weights, best = _moved(counts, aims, weights, best, name, factor)
    return weights


def _moved(
    counts: FloatArray,
    aims: tuple[int, ...],
    weights: PriorWeights,
    best: FloatArray,
    name: str,
    factor: float,
) -> tuple[PriorWeights, FloatArray]:
    """Multiply one weight by `factor` where that increases the log posterior."""
    tried = weights._replace(**{name: getattr(weights, name) * factor})
    score = _log_posterior(counts, tried, aims)
    better = score > best
    kept = PriorWeights(*(np.where(better, n, o) for n, o in zip(tried, weights, strict=True)))
    return kept, np.asarray(np.where(better, score, best))


def _log_posterior(counts: FloatArray, weights: PriorWeights, aims: tuple[int, ...]) -> FloatArray:
    # Here, as few who import this module fit a prior.
    from scipy.special import gammaln

    alpha = shared_prior(counts, weights, aims)
    total, trials = alpha.sum(axis=-1), counts.sum(axis=-1)
    rows = (gammaln(alpha + counts) - gammaln(alpha)).sum(axis=-1)
    rows = rows - gammaln(total + trials) + gammaln(total)
    away = sum(np.log(w / s) ** 2 / 2 for w, s in zip(weights, START, strict=True))
    return np.asarray(rows.sum(axis=(-1, -2, -3)) - away)
