"""A hierarchical Dirichlet prior of the outcomes of each pair, over all objects.

p(X_f | x_i, a) of every object is drawn from Dirichlet(c m), m the mean of the population for that
pair. What the other objects tell of m, with b pseudo-counts for each role of an outcome (the
object stays, reaches the target, ends elsewhere), is

    m ~ b + sum over other objects of y (c + 1) / (n + c),

n the trials of the pair with one object and y those that ended there: n trials of one object are
worth n (c + 1) / (n + c) draws from m. Of another object then p(X_f) has the prior
Dirichlet(s m),

    1 / (s + 1) = 1 / (c + 1) + 1 / (total + 1),

as its variance is that between objects and that of m. Only pairs that are to move the object are
alike in this; where nothing is to be moved every object stays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.latent_kernel import RowKernel

#: Greatest distance of a weight from START, log.
FARTHEST = 6.0


class PopulationWeights(NamedTuple):
    """Pseudo-counts b by role, and c."""

    stay: float
    aimed: float
    elsewhere: float
    concentration: float


START = PopulationWeights(1.0, 1.0, 0.1, 4.0)


def fit_population(rows: RowKernel, trials: FloatArray) -> PopulationWeights:
    """The weights that explain the trials of each object by those of the others best.

    They maximise the sum over objects of the log likelihood given the others, times a log-normal
    prior (standard deviation 1) around START.

    trials: shape [object, row, x_f].
    """
    if not trials.any():
        return START
    # Here, as few who import this module fit a prior.
    from scipy.optimize import minimize
    from scipy.special import gammaln

    n = trials.sum(axis=-1)

    def loss(logs: FloatArray) -> float:
        weights = PopulationWeights(*(np.array(START) * np.exp(logs)).tolist())
        alpha = population_prior(rows, trials, weights)
        total = alpha.sum(axis=-1)
        gain = (gammaln(alpha + trials) - gammaln(alpha)).sum()
        gain += (gammaln(total) - gammaln(total + n)).sum()
        return float(logs @ logs / 2 - gain)

    bounds = [(-FARTHEST, FARTHEST)] * len(START)
    found = minimize(loss, np.zeros(len(START)), method='L-BFGS-B', bounds=bounds)
    return PopulationWeights(*(np.array(START) * np.exp(found.x)).tolist())


def population_prior(
    rows: RowKernel, trials: FloatArray, weights: PopulationWeights
) -> FloatArray:
    """Pseudo-counts of each object given the trials of the others.

    trials: shape [object, row, x_f], as the result.
    """
    c = weights.concentration
    worth = trials * (c + 1) / (trials.sum(axis=-1, keepdims=True) + c)
    mean = _by_role(rows, trials.shape[-1], weights) + worth.sum(axis=0) - worth
    total = mean.sum(axis=-1, keepdims=True)
    size = 1 / (1 / (c + 1) + 1 / (total + 1)) - 1
    return np.asarray(size * mean / total)


def _by_role(rows: RowKernel, states: int, weights: PopulationWeights) -> FloatArray:
    """b, shape [row, x_f]."""
    found, at = np.full((len(rows.pairs), states), weights.elsewhere), np.arange(len(rows.pairs))
    found[at, rows.aims] = weights.aimed
    found[at, rows.pairs[:, 0]] = weights.stay
    return found
