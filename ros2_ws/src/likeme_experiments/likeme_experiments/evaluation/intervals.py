"""What tries say about a probability, what a model may say about tries, how far they part."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import special, stats

from likeme_inference.tabletop.arrays import FloatArray

LEVEL = 0.95
#: Of the expected calibration error, equally wide.
BINS = 10


class Interval(NamedTuple):
    """Bounds of a share, 0 to 1, both included."""

    low: float
    high: float

    def holds(self, share: float) -> bool:
        """Whether a share lies within the bounds, but for rounding."""
        return self.low - 1e-9 <= share <= self.high + 1e-9


def exact_interval(successes: int, tries: int, level: float = LEVEL) -> Interval:
    """Clopper and Pearson's bounds of the probability behind `successes` of `tries`.

    Tries of unequal probabilities, as in a row of four changes, make them wider than need be.

    Raises:
        ValueError: less than one try, or more successes than tries.
    """
    if not 0 <= successes <= tries or tries < 1:
        raise ValueError(f'Expected 0 to {tries} successes of 1 try or more, got {successes}.')
    tail = (1 - level) / 2
    misses = tries - successes
    low = float(special.betaincinv(successes, misses + 1, tail)) if successes else 0.0
    high = float(special.betaincinv(successes + 1, misses, 1 - tail)) if misses else 1.0
    return Interval(low, high)


def predictive_interval(success: FloatArray, tries: int, level: float = LEVEL) -> Interval:
    """Where a model expects the share of successes in `tries` to lie, equal-tailed.

    The model is not sure of its own probability: `success` holds draws of it from the posterior,
    shape [sample]. How many tries succeed is then a mixture of binomials; for one row of a
    Dirichlet posterior it is the beta-binomial. The bounds are counts, so they hold at least
    `level`, and more where tries are few.

    Raises:
        ValueError: less than one try.
    """
    if tries < 1:
        raise ValueError(f'Expected 1 try or more, got {tries}.')
    counts = np.arange(tries + 1)
    below = stats.binom.cdf(counts[:, None], tries, success[None, :]).mean(axis=1)
    tail = (1 - level) / 2
    # Rounding must not turn a certainty into a doubt.
    low, high = np.searchsorted(below, [tail + 1e-12, 1 - tail - 1e-12]).tolist()
    return Interval(low / tries, min(high, tries) / tries)


def calibration_error(
    predicted: ArrayLike, achieved: ArrayLike, tries: ArrayLike, bins: int = BINS
) -> float:
    """Expected calibration error: mean over tries of |predicted - achieved| of their bin.

    Args:
        predicted: share of each cell, 0 to 1, shape [cell].
        achieved: likewise.
        tries: of each cell, shape [cell].
        bins: of the predicted share, equally wide.

    Raises:
        ValueError: no try at all.
    """
    p, q, n = (np.asarray(v, dtype=np.float64) for v in (predicted, achieved, tries))
    if n.sum() <= 0:
        raise ValueError('Expected 1 try or more, got 0.')
    place = np.minimum((p * bins).astype(np.int64), bins - 1)
    gaps = [abs(float(((p - q) * n)[place == b].sum())) for b in range(bins)]
    return float(sum(gaps) / n.sum())
