"""Deviance of the real robot's ten trials of a row from a few simulated ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from likeme_experiments.physics_fit.multinomial_test import PSEUDO_COUNT

Floats = NDArray[np.float64]
# Upper bound: a row that no parameter can explain must not dominate the sum.
MAX_DEVIANCE = 16.0


def deviance(real: Sequence[int], simulated: Sequence[int]) -> float:
    """Twice the log likelihood ratio of real counts (3,) by simulated ones (3,).

    By the simulated trials the row's probabilities are Dirichlet distributed (Jeffreys' prior), so
    that the real counts are Dirichlet-multinomial. Relative to the best that as many simulated
    trials can reach; 0 to MAX_DEVIANCE.
    """
    n, total = np.asarray(real, dtype=float), float(sum(simulated))
    best = _log_likelihood(n, n / n.sum() * total)
    here = _log_likelihood(n, np.asarray(simulated, dtype=float))
    return float(np.clip(2.0 * (best - here), 0.0, MAX_DEVIANCE))


def _log_likelihood(real: Floats, simulated: Floats) -> float:
    """Of the Dirichlet-multinomial, up to a constant of the real counts."""
    a = simulated + PSEUDO_COUNT
    both = gammaln(real + a) - gammaln(a)
    return float(both.sum() + gammaln(a.sum()) - gammaln(a.sum() + real.sum()))
