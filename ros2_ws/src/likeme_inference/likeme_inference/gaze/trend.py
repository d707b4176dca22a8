"""A linear trend under a Gaussian process, with a vague prior on its coefficients.

y(x) = h(x)'γ + f(x) + noise with h = (1, x) and f of the squared-exponential kernel: explicit
basis functions, Rasmussen and Williams 2006, section 2.7. The trend takes up what is linear, which
for a head is most of it, so that the kernel's lengthscales can follow what bends; the coefficients
are integrated out, so that their doubt stays in every prediction. Everywhere K⁻¹ becomes
P = K⁻¹ - K⁻¹H B H'K⁻¹ with B = (H'K⁻¹H)⁻¹.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from likeme_inference.gaze.checks import FloatArray


class Basis(NamedTuple):
    """h(x) = (1, (x - centre) / scale): the same trend as (1, x), well conditioned.

    Attributes:
        centre, scale: (D,).
    """

    centre: FloatArray
    scale: FloatArray

    def of(self, points: FloatArray) -> FloatArray:
        """h at points (..., D), shape (..., 1 + D)."""
        basis = np.ones((*points.shape[:-1], 1 + points.shape[-1]))
        np.divide(points - self.centre, self.scale, out=basis[..., 1:])
        return basis


class Trend(NamedTuple):
    """One output's trend given its training data.

    Attributes:
        basis: h.
        coefficients: E[γ] (1 + D,).
        doubt: B = Cov[γ] (1 + D, 1 + D).
        solved: K⁻¹H (n, 1 + D).
    """

    basis: Basis
    coefficients: FloatArray
    doubt: FloatArray
    solved: FloatArray

    @property
    def slope(self) -> FloatArray:
        """Derivative of the trend by x (D,)."""
        return np.asarray(self.coefficients[1:] / self.basis.scale)

    def mean(self, at: FloatArray) -> FloatArray:
        """E[h(x)'γ] for inputs with mean `at` (B, D); shape (B,)."""
        return np.asarray(self.basis.of(at) @ self.coefficients)

    def open_variance(
        self, at: FloatArray, covariance: FloatArray, q: FloatArray, crossed: FloatArray
    ) -> FloatArray:
        """What the coefficients' doubt adds to the output's variance (B,).

        With R(x) = h(x) - H'K⁻¹k(x) it is E[R'BR]; the share of Cov[k(x)] is left to the sum over
        all pairs of training inputs, where P stands for K⁻¹.

        Args:
            at: input means (B, D).
            covariance: input covariances (B, D, D).
            q: E[k(x)] (B, n).
            crossed: Cov[x, k(x)] (B, D, n).
        """
        average = self.basis.of(at) - q @ self.solved
        scale = self.basis.scale
        slopes = self.doubt[1:, 1:] / (scale[:, None] * scale)
        weights = (self.solved @ self.doubt[:, 1:]) / scale
        spread = covariance.reshape(len(covariance), -1) @ slopes.ravel()
        shared = crossed.reshape(len(crossed), -1) @ weights.T.ravel()
        return np.asarray(((average @ self.doubt) * average).sum(-1) + spread - 2 * shared)


def basis_for(inputs: FloatArray) -> Basis:
    """The basis centred on the training inputs (n, D)."""
    scale = inputs.std(axis=0)
    return Basis(inputs.mean(axis=0), np.where(scale > 0, scale, 1.0))


def coefficients_doubt(lower: FloatArray, columns: FloatArray) -> tuple[FloatArray, ...]:
    """K⁻¹H (n, m), B = (H'K⁻¹H)⁻¹ (m, m) and log|H'K⁻¹H| by the Cholesky factor of K.

    Raises:
        ValueError: inputs that do not span the trend.
    """
    solved = lapack.dpotrs(lower, columns, lower=1)[0]
    factor, failed = lapack.dpotrf(columns.T @ solved, lower=1)
    if failed:
        raise ValueError(
            f'Expected inputs that determine a trend of {columns.shape[1]} coefficients, got '
            f'{len(columns)} points of lower rank.'
        )
    below, _ = lapack.dpotri(factor, lower=1)
    doubt = below + below.T
    doubt.flat[:: len(doubt) + 1] *= 0.5
    return solved, doubt, 2 * np.log(factor.diagonal()).sum()
