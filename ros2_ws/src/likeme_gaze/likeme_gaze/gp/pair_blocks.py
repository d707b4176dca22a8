"""Every unordered pair of training inputs once, for sums over symmetric tables.

The n inputs are divided into an odd number m of blocks, ordered cyclically; each block is paired
with itself and with the (m - 1) / 2 blocks after it. Block r and the (m + 1) / 2 blocks from r on
form one rectangle; all rectangles have the same shape and every two blocks meet exactly once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_gaze.checks import FloatArray

#: Number of blocks, and the fewest inputs for which blocks are faster.
BLOCKS = 5
MIN_INPUTS = 50


class PairBlocks(NamedTuple):
    """m rectangles of s rows and w columns.

    Attributes:
        rows: training inputs along each rectangle's rows (m, s).
        columns: training inputs along its columns (m, w).
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]

    def folded(self, table: FloatArray) -> FloatArray:
        """Weights (m, s, w) for which a sum over the rectangles equals one over all i and j.

        For a symmetric `table` (n, n), times anything else symmetric. The weight of a pair that
        occurs more than once, where the blocks exceed n, is divided among its occurrences.
        """
        at = self.rows[:, :, None], self.columns[:, None, :]
        met = np.zeros_like(table)
        np.add.at(met, at, 1.0)
        return np.asarray((2 * table / np.maximum(met + met.T, 1))[at])


def every_pair(count: int) -> PairBlocks:
    """One rectangle with every i and every j."""
    whole = np.arange(count)[None]
    return PairBlocks(whole, whole)


def each_pair_once(count: int) -> PairBlocks:
    """The rectangles of the cyclic blocks over `count` inputs."""
    if count < MIN_INPUTS:
        return every_pair(count)
    size = -(-count // BLOCKS)
    first = size * np.arange(BLOCKS)[:, None]
    around, reach = size * BLOCKS, size * (BLOCKS + 1) // 2
    return PairBlocks(
        (first + np.arange(size)) % count, (first + np.arange(reach)) % around % count
    )
