"""How badly a few simulated trials of a row agree with the real robot's ten."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from likeme_experiments.physics_fit.multinomial_test import PSEUDO_COUNT

Floats = NDArray[np.float64]
# A row that cannot be explained must not decide everything.
WORST = 16.0


def misfit(real: Sequence[int], simulated: Sequence[int]) -> float:
    """-2 log of how likely the real counts (3,) are after the simulated ones (3,), 0 to WORST.

    The simulated trials leave a Dirichlet distribution over the row's probabilities (Jeffreys'
    prior), so that few of them say little: the real counts are Dirichlet-multinomial. Zero is
    what as many simulated trials as there are can reach at best.
    """
    n, total = np.asarray(real, dtype=float), float(sum(simulated))
    best = _log_likelihood(n, n / n.sum() * total)
    here = _log_likelihood(n, np.asarray(simulated, dtype=float))
    return float(np.clip(2.0 * (best - here), 0.0, WORST))


def _log_likelihood(real: Floats, simulated: Floats) -> float:
    """Of the Dirichlet-multinomial, without the factor that hangs on the real counts alone."""
    a = simulated + PSEUDO_COUNT
    both = gammaln(real + a) - gammaln(a)
    return float(both.sum() + gammaln(a.sum()) - gammaln(a.sum() + real.sum()))
