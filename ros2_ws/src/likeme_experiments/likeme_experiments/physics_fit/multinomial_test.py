"""The exact multinomial test of 10 real trials against a simulated row."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, xlogy

Floats = NDArray[np.float64]
# Tolerance for results that are exactly as likely as the observed one.
TIE = 1.0 + 1e-9
# Jeffreys' prior: an outcome that 50 trials never showed is rare, not impossible.
PSEUDO_COUNT = 0.5


@lru_cache(maxsize=8)
def _compositions(trials: int) -> NDArray[np.int64]:
    """All counts of three outcomes that sum to `trials`, (N, 3)."""
    first, second = np.meshgrid(np.arange(trials + 1), np.arange(trials + 1), indexing='ij')
    kept = first + second <= trials
    return np.stack([first[kept], second[kept], trials - first[kept] - second[kept]], axis=1)


def smoothed(counts: Sequence[int] | Floats) -> Floats:
    """Probabilities of the outcomes from simulated counts, (3,)."""
    raised = np.asarray(counts, dtype=float) + PSEUDO_COUNT
    return np.asarray(raised / raised.sum())


def multinomial_p_value(observed: Sequence[int], probabilities: Floats) -> float:
    """Probability, under `probabilities` (3,), of a result at most as likely as `observed` (3,).

    Raises:
        ValueError: not three counts and three probabilities that sum to 1.
    """
    p = np.asarray(probabilities, dtype=float)
    if p.shape != (3,) or len(observed) != 3:
        raise ValueError(f'Expected 3 counts and 3 probabilities, got {len(observed)}, {p.shape}.')
    if not np.isclose(p.sum(), 1.0):
        raise ValueError(f'Expected probabilities to sum to 1, got {p.sum():.3f}.')
    trials = int(sum(observed))
    likely = np.exp(_log_pmf(_compositions(trials), trials, p))
    here = float(np.exp(_log_pmf(np.asarray([observed]), trials, p))[0])
    return float(min(1.0, likely[likely <= here * TIE].sum()))


def _log_pmf(counts: NDArray[np.int64], trials: int, p: Floats) -> Floats:
    ways = gammaln(trials + 1) - gammaln(counts + 1).sum(axis=1)
    return np.asarray(ways + xlogy(counts, p).sum(axis=1))
