"""Exact moments of Gaussian processes whose input is Gaussian (Deisenroth et al. 2009, section 4).

Everything that a textbook forms as a difference of nearly equal numbers is formed here from its
small part. With k_a(x) the kernel of output a between x and training input i,

    q_i  = E[k_a(x)]                 kept as log q_i
    e_ij = log E[k_a(x) k_b(x)]_ij - log q_i - log q_j

e_ij vanishes with the input's covariance, and so does what it is needed for (pair_sums):
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

from likeme_gaze.beliefs import Gaussian
from likeme_gaze.checks import FloatArray
from likeme_gaze.conditioning import Conditioned
from likeme_gaze.kernel import Real
from likeme_gaze.triangular import cholesky, cholesky_by_rows, solve_lower, transposed

#: Above this ratio of an input's variance to its squared lengthscale S + Λ is factored in
#: extended precision. (The ratio, since the factor's rounding does not depend on units.)
WIDE = 1e4


class View(NamedTuple):
    """How a Gaussian input N(m, S) sees the kernel of every output.

    Attributes:
        distance: x_i - m (B, D, n).
        whitened: L⁻¹(x_i - m) with LL' = S + Λ (E, B, D, n).
        log_q: log E[k(x, x_i)] (E, B, n).
        q: E[k(x, x_i)] (E, B, n).
        root: L⁻¹ (E, B, D, D).
        shrink: L⁻¹S (E, B, D, D).
        pull: S(S + Λ)⁻¹ (E, B, D, D): weighted by the kernel of x_i the input's mean is
            m + pull (x_i - m),
        tilted: and its covariance (S⁻¹ + Λ⁻¹)⁻¹ (E, B, D, D).
    """

    distance: FloatArray
    whitened: FloatArray
    log_q: FloatArray
    q: FloatArray
    root: FloatArray
    shrink: FloatArray
    pull: FloatArray
    tilted: FloatArray


class FirstMoments(NamedTuple):
    """What needs no pair of training inputs.

    Attributes:
        mean: E[y] (E, B).
        cross: Cov[x, m(x)] (E, B, D), less what a trend adds.
        gain: S⁻¹Cov[x, m(x)] (E, B, D), which exists for singular S too, as much of it.
        variance: σ_f² - q'K⁻¹q (E, B), what the training data leave open if k(x) were its average
            q, and the doubt of a trend's coefficients.
    """

    mean: FloatArray
    cross: FloatArray
    gain: FloatArray
    variance: FloatArray


def view(inputs: FloatArray, outputs: Conditioned, at: Gaussian) -> View:
    """Every output's kernel, averaged over the input; see View."""
    mean, covariance = at
    distance = inputs.T - mean[:, :, None]
    variances = np.diagonal(covariance, axis1=-2, axis2=-1).max(axis=0, initial=0.0)
    wide = bool((variances > WIDE * outputs.squares).any())
    volume, root, shrink, whitened = _whitened(covariance, outputs.kernels, distance, wide)
    log_q = (outputs.log_peak[:, None] - volume)[..., None] - 0.5 * (whitened**2).sum(axis=-2)
    pull = transposed(shrink) @ root
    tilted = pull * outputs.squares[:, None, None, :]
    tilted = (tilted + transposed(tilted)) / 2
    return View(distance, whitened, log_q, np.exp(log_q), root, shrink, pull, tilted)


def _whitened(
    covariance: FloatArray, kernels: FloatArray, distance: FloatArray, wide: bool
) -> tuple[FloatArray, ...]:
    """½ log|S + Λ|, L⁻¹, L⁻¹S and L⁻¹(x_i - m) with LL' = S + Λ.

    Where S is far larger than Λ it hides Λ in the directions in which S may be singular; what
    doubles would lose there is kept by extended precision, at the price of a slower pass.
    """
    if not wide:
        return _solved(cholesky(covariance + kernels), covariance, distance)
    precise, away = covariance.astype(np.longdouble), distance.astype(np.longdouble)
    parts = _solved(cholesky_by_rows(precise + kernels), precise, away)
    return tuple(part.astype(np.float64) for part in parts)


def _solved(
    lower: NDArray[Real], covariance: NDArray[Real], distance: NDArray[Real]
) -> tuple[NDArray[Real], ...]:
    width = lower.shape[-1]
    right = np.empty((*lower.shape[:-1], 2 * width), dtype=lower.dtype)
    right[..., :width], right[..., width:] = np.identity(width), covariance
    solved = solve_lower(lower, right)
    root, shrink = solved[..., :width], solved[..., width:]
    volume = np.log(np.diagonal(lower, axis1=-2, axis2=-1)).sum(axis=-1)
    return volume, root, shrink, root @ distance


def first_moments(seen: View, outputs: Conditioned, at: Gaussian) -> FirstMoments:
    """Means, covariances with the input, and the average variances; see FirstMoments."""
    trends, sums = outputs.trends, seen.q @ outputs.by_q
    pulled = (seen.whitened * seen.q[:, :, None, :]) @ outputs.by_pull[:, None]
    along = pulled[..., :1]
    cross, gain = transposed(seen.shrink) @ along, transposed(seen.root) @ along
    mean, variance = sums[..., 0], _remaining(seen.q, outputs)
    if trends is not None:
        basis = trends.basis.of(at.mean)
        shared = (seen.shrink * pulled[..., 1:]).sum(axis=(-2, -1))
        variance += trends.open_variance(at.covariance, basis - sums[..., 1:], shared)
        mean = mean + trends.coefficients @ basis.T
    return FirstMoments(mean, cross[..., 0], gain[..., 0], variance)


def _remaining(q: FloatArray, outputs: Conditioned) -> FloatArray:
    """σ_f² - q'K⁻¹q (E, B), without trends."""
    known = np.empty(q.shape[:-1])
    for e, lower in enumerate(outputs.lowers):
        # LAPACK itself, on the transpose, which is in its order: nothing is checked or copied.
        solved = lapack.dtrtrs(lower.T, q[e].T, lower=0, trans=1)[0]
        np.einsum('ib,ib->b', solved, solved, out=known[e])
    return np.maximum(outputs.signal_variance[:, None] - known, 0)
