"""Every unordered pair of training inputs once: half the work of a symmetric table.

The n inputs are cut into an odd number of blocks in a ring; each block is paired with itself and
with the half of the ring that follows it. So block r and the (m + 1) / 2 blocks from r on form one
rectangle, all rectangles have the same shape, and each two blocks meet exactly once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_gaze.checks import FloatArray

#: Blocks in the ring, and the fewest inputs that are worth cutting.
BLOCKS = 5
WORTH_CUTTING = 50


class PairBlocks(NamedTuple):
    """m rectangles of s rows and w columns.

    Attributes:
        rows: training inputs along each rectangle's rows (m, s).
        columns: and along its columns (m, w).
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]

    def folded(self, table: FloatArray) -> FloatArray:
        """Weights (m, s, w) under which a sum over the rectangles is one over all i and j.

        For a symmetric `table` (n, n), times anything else that is symmetric. A pair that is met
        more than once, as at the seam of a ring that n does not fill, shares its weight out.
        """
        at = self.rows[:, :, None], self.columns[:, None, :]
        met = np.zeros_like(table)
        np.add.at(met, at, 1.0)
        return np.asarray((2 * table / np.maximum(met + met.T, 1))[at])


def every_pair(count: int) -> PairBlocks:
    """One rectangle: each i with each j."""
    whole = np.arange(count)[None]
    return PairBlocks(whole, whole)


def each_pair_once(count: int) -> PairBlocks:
    """The ring of blocks over `count` inputs."""
    if count < WORTH_CUTTING:
        return every_pair(count)
    size = -(-count // BLOCKS)
    first = size * np.arange(BLOCKS)[:, None]
    around, reach = size * BLOCKS, size * (BLOCKS + 1) // 2
    return PairBlocks(
        (first + np.arange(size)) % count, (first + np.arange(reach)) % around % count
    )
