"""Confidence and predictive intervals of proportions, and the expected calibration error."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import special, stats

from likeme_inference.tabletop.arrays import FloatArray

LEVEL = 0.95
#: Bins of the expected calibration error, equally wide.
BINS = 10


class ProportionInterval(NamedTuple):
    """Bounds of a proportion, 0 to 1, both included."""

    low: float
    high: float

    def holds(self, share: float) -> bool:
        """Whether a proportion lies within the bounds, up to rounding."""
        return self.low - 1e-9 <= share <= self.high + 1e-9


def exact_interval(successes: int, tries: int, level: float = LEVEL) -> ProportionInterval:
    """Clopper and Pearson's bounds of the probability behind `successes` of `tries`.

    Conservative where the tries have unequal probabilities, as in a row of four changes.

    Raises:
        ValueError: less than one try, or more successes than tries.
    """
    if not 0 <= successes <= tries or tries < 1:
        raise ValueError(f'Expected 0 to {tries} successes of 1 try or more, got {successes}.')
    tail = (1 - level) / 2
    misses = tries - successes
    low = float(special.betaincinv(successes, misses + 1, tail)) if successes else 0.0
    high = float(special.betaincinv(successes + 1, misses, 1 - tail)) if misses else 1.0
    return ProportionInterval(low, high)


def predictive_interval(
    success: FloatArray, tries: int, level: float = LEVEL
) -> ProportionInterval:
    """Equal-tailed predictive interval of the proportion of successes in `tries`.

    `success` holds posterior draws of the probability, shape [sample]: the number of successes is
    a mixture of binomials, for one row of a Dirichlet posterior the beta-binomial. The bounds are
    counts, so that they cover at least `level`, and more where tries are few.

    Raises:
        ValueError: less than one try.
    """
    if tries < 1:
        raise ValueError(f'Expected 1 try or more, got {tries}.')
    counts = np.arange(tries + 1)
    below = stats.binom.cdf(counts[:, None], tries, success[None, :]).mean(axis=1)
    tail = (1 - level) / 2
    # Rounding must not widen the interval of a certain result.
    low, high = np.searchsorted(below, [tail + 1e-12, 1 - tail - 1e-12]).tolist()
    return ProportionInterval(low / tries, min(high, tries) / tries)


def calibration_error(
    predicted: ArrayLike, achieved: ArrayLike, tries: ArrayLike = 1.0, bins: int = BINS
) -> float:
    """Expected calibration error: mean over tries of |predicted - achieved| of their bin.

    Args:
        predicted: proportion of each cell, 0 to 1, shape [cell].
        achieved: likewise.
        tries: of each cell, shape [cell]; 1: one of each.
        bins: of the predicted proportion, equally wide.

    Raises:
        ValueError: no try at all.
    """
    p, q, n = (np.asarray(v, dtype=np.float64) for v in (predicted, achieved, tries))
    n = np.broadcast_to(n, p.shape)
    if n.sum() <= 0:
        raise ValueError('Expected 1 try or more, got 0.')
    place = np.minimum((p * bins).astype(np.int64), bins - 1)
    gaps = [abs(float(((p - q) * n)[place == b].sum())) for b in range(bins)]
    return float(sum(gaps) / n.sum())
