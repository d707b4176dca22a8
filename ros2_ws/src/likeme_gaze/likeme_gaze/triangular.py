"""Cholesky factors of many small matrices at once, and what they solve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from likeme_gaze.checks import FloatArray
from likeme_gaze.kernel import Real


def transposed(matrices: NDArray[Real]) -> NDArray[Real]:
    """The last two axes swapped."""
    return matrices.swapaxes(-1, -2)


def cholesky(matrices: FloatArray) -> FloatArray:
    """Lower Cholesky factors of a batch (..., D, D)."""
    return np.asarray(np.linalg.cholesky(matrices), dtype=np.float64)


def cholesky_by_rows(matrices: NDArray[np.longdouble]) -> NDArray[np.longdouble]:
    """Lower Cholesky factors (..., D, D) in a precision LAPACK does not have."""
    lower = np.zeros_like(matrices)
    for d in range(matrices.shape[-1]):
        known = lower[..., d, :d]
        lower[..., d, d] = np.sqrt(matrices[..., d, d] - (known**2).sum(axis=-1))
        rest = matrices[..., d + 1 :, d] - (lower[..., d + 1 :, :d] @ known[..., None])[..., 0]
        lower[..., d + 1 :, d] = rest / lower[..., d, d, None]
    return lower


def solve_lower(lower: NDArray[Real], right: NDArray[Real]) -> NDArray[Real]:
    """L⁻¹ r by forward substitution, batched: L (..., D, D), r (..., D, k)."""
    solved = np.empty_like(right)
    for d in range(lower.shape[-1]):
        left = right[..., d, :]
        if d:
            left = left - (lower[..., d, None, :d] @ solved[..., :d, :])[..., 0, :]
        np.divide(left, lower[..., d, d, None], out=solved[..., d, :])
    return solved
