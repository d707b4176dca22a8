"""Exact moments of Gaussian processes whose input is Gaussian (Deisenroth et al. 2009, section 4).

Everything that a textbook forms as a difference of nearly equal numbers is formed here from its
small part. With k_a(x) the kernel of output a between x and training input i,

    q_i  = E[k_a(x)]                 kept as log q_i
    e_ij = log E[k_a(x) k_b(x)]_ij - log q_i - log q_j

e_ij vanishes with the input's covariance, and so does what it is needed for:
Cov[k_a(x), k_b(x)]_ij = q_i q_j expm1(e_ij). Matrices of the size of the input (D) enter by
Cholesky factors; an input covariance S may be singular, since only S + Λ is ever factored.
All outputs, and all pairs of outputs, are computed at once: arrays have the axes (outputs E or
pairs P, batch B, ...).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from likeme_inference.gaze.beliefs import Gaussian
from likeme_inference.gaze.checks import FloatArray
from likeme_inference.gaze.conditioning import Conditioned
from likeme_inference.gaze.kernel import Real

#: Above this e_ij the product q_i q_j expm1(e_ij) is formed in the log domain: q could be 0.
LARGE = 30.0
#: Above this ratio of the input's variances to a squared lengthscale S + Λ is factored in
#: extended precision.
WIDE = 1e4


class View(NamedTuple):
    """How a Gaussian input N(m, S) sees the kernel of every output.

    Attributes:
        distance: x_i - m (E, B, D, n).
        whitened: L⁻¹(x_i - m) with LL' = S + Λ (E, B, D, n).
        log_q: log E[k(x, x_i)] (E, B, n).
        shrink: L⁻¹S (E, B, D, D).
        tilted: (S⁻¹ + Λ⁻¹)⁻¹, the input's covariance once the kernel has weighted it.
        lower: L (E, B, D, D).
    """

    distance: FloatArray
    whitened: FloatArray
    log_q: FloatArray
    shrink: FloatArray
    tilted: FloatArray
    lower: FloatArray


def view(inputs: FloatArray, outputs: Conditioned, at: Gaussian) -> View:
    """Every output's kernel, averaged over the input; see View."""
    mean, covariance = at
    squares = outputs.squares[:, None, :]
    width, shape = inputs.shape[1], (len(squares), *covariance.shape)
    kernel = np.broadcast_to(squares[..., None] * np.eye(width), shape)
    distance = inputs.T - mean[:, :, None]
    distance = np.broadcast_to(distance, (len(squares), *distance.shape))
    parts = np.concatenate([np.broadcast_to(covariance, shape), kernel, distance], axis=-1)
    wide = np.trace(covariance, axis1=-2, axis2=-1).max(initial=0.0) > WIDE * squares.min()
    lower, solved = _factored(covariance, kernel, parts, bool(wide))
    shrink, whitened = solved[..., :width], solved[..., 2 * width :]
    tilted = transposed(shrink) @ solved[..., width : 2 * width]
    widening = np.log(np.diagonal(lower, axis1=-2, axis2=-1) / np.sqrt(squares)).sum(axis=-1)
    log_q = (outputs.log_signal_variance[:, None] - widening)[..., None]
    log_q = log_q - 0.5 * (whitened**2).sum(axis=-2)
    return View(distance, whitened, log_q, shrink, (tilted + transposed(tilted)) / 2, lower)


def _factored(
    covariance: FloatArray, kernel: FloatArray, right: FloatArray, wide: bool
) -> tuple[FloatArray, FloatArray]:
    """L with LL' = S + Λ, and L⁻¹ `right`.

    Where S is far larger than Λ it hides Λ in the directions in which S may be singular; what
    doubles would lose there is kept by extended precision, at the price of a slower pass.
    """
    if not wide:
        lower = cholesky(covariance + kernel)
        return lower, solve_lower(lower, right)
    precise = _cholesky_by_rows(covariance.astype(np.longdouble) + kernel)
    solved = solve_lower(precise, right.astype(np.longdouble))
    return precise.astype(np.float64), solved.astype(np.float64)


def _cholesky_by_rows(matrices: NDArray[np.longdouble]) -> NDArray[np.longdouble]:
    """Lower Cholesky factors (..., D, D) in a precision LAPACK does not have."""
    lower = np.zeros_like(matrices)
    for d in range(matrices.shape[-1]):
        known = lower[..., d, :d]
        lower[..., d, d] = np.sqrt(matrices[..., d, d] - (known**2).sum(axis=-1))
        rest = matrices[..., d + 1 :, d] - (lower[..., d + 1 :, :d] @ known[..., None])[..., 0]
        lower[..., d + 1 :, d] = rest / lower[..., d, d, None]
    return lower


def first_moments(seen: View, outputs: Conditioned) -> tuple[FloatArray, FloatArray, FloatArray]:
    """E[m(x)] (E, B), Cov[x, m(x)] (E, B, D) and its gain S⁻¹Cov[x, m(x)] (E, B, D).

    The gain exists for singular S too.
    """
    weighted = outputs.weights[:, None] * np.exp(seen.log_q)
    pulled = seen.whitened @ weighted[..., None]
    cross = transposed(seen.shrink) @ pulled
    return weighted.sum(axis=-1), cross[..., 0], solve_upper(seen.lower, pulled)[..., 0]


def pair_sums(seen: View, outputs: Conditioned) -> FloatArray:
    """Σ_ij w_ij q_ai q_bj expm1(e_ij) of every pair of outputs (P, B).

    With the pair's table w = ββ' this is Cov[m_a(x), m_b(x)]; one output's own table has K⁻¹
    taken off, which adds how much of its variance varies with x.
    """
    a, b = outputs.first, outputs.second
    excess, bound = _excess(seen, outputs)
    left, right = seen.log_q[a], seen.log_q[b]
    if bound > LARGE:
        base = left[..., :, None] + right[..., None, :]
        near = np.exp(base) * np.expm1(np.minimum(excess, LARGE))
        products = np.where(excess > LARGE, np.exp(base + excess), near)
        return np.asarray((products * outputs.tables[:, None]).sum(axis=(-2, -1)))
    np.expm1(excess, out=excess)
    excess *= outputs.tables[:, None]
    inner = (np.exp(left)[..., None, :] @ excess)[..., 0, :]
    return np.asarray((inner * np.exp(right)).sum(axis=-1))


def _excess(seen: View, outputs: Conditioned) -> tuple[FloatArray, float]:
    """e_ij of every pair of outputs (P, B, n, n), and what none of them exceeds."""
    a, b = outputs.first, outputs.second
    count, width = seen.distance.shape[-1], seen.distance.shape[-2]
    lower = cholesky(seen.tilted[a] + outputs.squares[b][:, None, :, None] * np.eye(width))
    flipped = transposed(seen.shrink[a])
    parts = [seen.distance[a], flipped @ seen.whitened[a], flipped]
    solved = solve_lower(lower, np.concatenate(parts, axis=-1))
    apart, moved, shared = np.split(solved, [count, 2 * count], axis=-1)
    overlap = transposed(shared) @ shared
    # -½ d'[(Λ_b + S_a)⁻¹ - (Λ_b + S)⁻¹]d of every training input, by Woodbury.
    inner = solve_lower(cholesky(np.eye(width) + overlap), transposed(shared) @ apart)
    volume = np.log1p(np.maximum(np.linalg.eigvalsh(overlap), 0)).sum(axis=-1)
    row = -0.5 * (moved**2).sum(axis=-2, keepdims=True)
    column = 0.5 * (volume[..., None, None] - (inner**2).sum(axis=-2, keepdims=True))
    ones = np.ones_like(row)
    left = np.concatenate([moved, row, ones], axis=-2)
    excess = transposed(left) @ np.concatenate([apart, ones, column], axis=-2)
    longest = np.sqrt(-2 * row.min(initial=0.0) * (apart**2).sum(axis=-2).max(initial=0.0))
    return np.asarray(excess), float(longest + volume.max(initial=0.0) / 2)


def remaining_variances(seen: View, outputs: Conditioned, at: Gaussian) -> FloatArray:
    """σ_f² - q'K⁻¹q (E, B): what the training data leave open if k(x) were its average q.

    A trend adds the doubt of its coefficients.
    """
    q = np.exp(seen.log_q)
    left = np.empty(q.shape[:-1])
    for e, lower in enumerate(outputs.lowers):
        # LAPACK itself, on the transpose, which is in its order: nothing is checked or copied.
        solved = lapack.dtrtrs(lower.T, q[e].T, lower=0, trans=1)[0]
        open_ = np.exp(outputs.log_signal_variance[e]) - (solved**2).sum(axis=0)
        left[e] = np.maximum(open_, 0)
        if outputs.trends:
            crossed = q[e, :, None, :] * (transposed(seen.shrink[e]) @ seen.whitened[e])
            left[e] += outputs.trends[e].open_variance(*at, q[e], crossed)
    return left


def transposed(matrices: FloatArray) -> FloatArray:
    """The last two axes swapped."""
    return np.swapaxes(matrices, -1, -2)


def cholesky(matrices: FloatArray) -> FloatArray:
    """Lower Cholesky factors of a batch (..., D, D)."""
    return np.asarray(np.linalg.cholesky(matrices), dtype=np.float64)


def solve_lower(lower: NDArray[Real], right: NDArray[Real]) -> NDArray[Real]:
    """L⁻¹ r by forward substitution, batched: L (..., D, D), r (..., D, k)."""
    solved = np.empty_like(right)
    for d in range(lower.shape[-1]):
        left = right[..., d, :]
        if d:
            left = left - (lower[..., d, None, :d] @ solved[..., :d, :])[..., 0, :]
        np.divide(left, lower[..., d, d, None], out=solved[..., d, :])
    return solved


def solve_upper(lower: FloatArray, right: FloatArray) -> FloatArray:
    """L'⁻¹ r by back substitution, batched: L (..., D, D), r (..., D, k)."""
    solved = np.empty_like(right)
    for d in reversed(range(lower.shape[-1])):
        known = (lower[..., None, d + 1 :, d] @ solved[..., d + 1 :, :])[..., 0, :]
        solved[..., d, :] = (right[..., d, :] - known) / lower[..., d, d, None]
    return solved
