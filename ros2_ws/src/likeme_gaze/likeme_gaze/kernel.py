"""The squared-exponential kernel with one lengthscale per input, and its marginal likelihood.

k(x, x') = σ_f² exp(-½ Σ_d (x_d - x'_d)² / ℓ_d²), observed with noise of variance σ_n².
Logarithms of hyperparameters are ordered [log ℓ_1 ... log ℓ_D, log σ_f, log σ_n] throughout.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from likeme_gaze.checks import FloatArray
from likeme_gaze.trend import coefficients_doubt

Real = TypeVar('Real', np.float64, np.longdouble)
LOG_2_PI = float(np.log(2 * np.pi))


def squared_distances(inputs: NDArray[Real]) -> NDArray[Real]:
    """(x_id - x_jd)² of every pair, one plane per input dimension; shape (D, n, n)."""
    columns = inputs.T
    squares: NDArray[Real] = (columns[:, :, None] - columns[:, None, :]) ** 2
    return squares


def gram(squared: NDArray[Real], log_hyperparameters: NDArray[Real]) -> NDArray[Real]:
    """The kernel of every pair without the noise; shape (n, n).

    `squared` are the squared distances (D, n, n). The result has the precision of its arguments.
    """
    inverse_squares = np.exp(-2 * log_hyperparameters[:-2])
    exponent = (-0.5 * inverse_squares @ squared.reshape(len(squared), -1)).reshape(
        squared[0].shape
    )
    exponent += 2 * log_hyperparameters[-2]
    kernel: NDArray[Real] = np.exp(exponent, out=exponent)
    return kernel


def factor(covariance: FloatArray, log_noise_std: float) -> FloatArray:
    """Lower Cholesky factor of the kernel matrix plus noise; shape (n, n).

    Raises:
        ValueError: the noise is too small for the matrix to be positive definite in doubles.
    """
    noisy = covariance.copy()
    noisy.flat[:: len(noisy) + 1] += np.exp(2 * log_noise_std)
    # LAPACK itself: with 15 training points the checks of linalg.cholesky cost more than the work.
    lower, failed = lapack.dpotrf(noisy, lower=1)
    if failed:
        raise ValueError(
            f'Expected noise that keeps the kernel matrix of {len(noisy)} inputs positive '
            f'definite, got a standard deviation of {np.exp(log_noise_std):g} for a signal of '
            f'{np.sqrt(covariance[0, 0]):g}.'
        )
    return np.asarray(lower)


def solve(lower: FloatArray, right: FloatArray) -> FloatArray:
    """K⁻¹ r by the Cholesky factor of K; r (n,)."""
    return np.asarray(lapack.dpotrs(lower, right, lower=1)[0])


def negative_log_likelihood(
    lower: FloatArray, weights: FloatArray, target: FloatArray, trend: tuple[int, float] = (0, 0.0)
) -> float:
    """-log p(y | X) = ½ y'β + ½ log|K| + ½ n log 2π, with `weights` β = K⁻¹y.

    With a trend of m coefficients (eq. 2.45 of Rasmussen and Williams 2006) β = Py, log|H'K⁻¹H|
    joins log|K| and n - m stands for n; `trend` is (m, log|H'K⁻¹H|).
    """
    fit = 0.5 * (float(target @ weights) + trend[1])
    return fit + float(np.log(lower.diagonal()).sum()) + 0.5 * (len(target) - trend[0]) * LOG_2_PI


def likelihood_and_gradient(
    log_hyperparameters: FloatArray,
    squared: FloatArray,
    target: FloatArray,
    columns: FloatArray | None = None,
) -> tuple[float, FloatArray]:
    """-log p(y | X) and its gradient by the logarithms of the hyperparameters, in their order.

    d/dθ = -½ tr((ββ' - K⁻¹) dK/dθ) with β = K⁻¹y (Rasmussen and Williams 2006, eq. 5.9); with a
    trend, whose basis at the training inputs is `columns` (n, m), P replaces K⁻¹.
    """
    signal = gram(squared, log_hyperparameters)
    lower = factor(signal, float(log_hyperparameters[-1]))
    inverse = precision(lower)
    trend = (0, 0.0)
    if columns is not None:
        solved, doubt, volume = coefficients_doubt(lower, columns)
        inverse -= solved @ doubt @ solved.T
        trend = (len(doubt), float(volume))
    weights = inverse @ target if columns is not None else solve(lower, target)
    evidence = weights[:, None] * weights - inverse
    noise = np.exp(2 * log_hyperparameters[-1])
    gradient = np.empty(len(log_hyperparameters))
    gradient[-1] = -noise * evidence.trace()
    evidence *= signal
    gradient[-2] = -evidence.sum()
    by_lengthscale = squared.reshape(len(squared), -1) @ evidence.ravel()
    gradient[:-2] = -0.5 * np.exp(-2 * log_hyperparameters[:-2]) * by_lengthscale
    return negative_log_likelihood(lower, weights, target, trend), gradient


def precision(lower: FloatArray) -> FloatArray:
    """K⁻¹ from the Cholesky factor of K, for traces and sums over all pairs; shape (n, n)."""
    below, _ = lapack.dpotri(lower, lower=1)
    whole: FloatArray = below + below.T
    whole.flat[:: len(whole) + 1] *= 0.5
    return whole
