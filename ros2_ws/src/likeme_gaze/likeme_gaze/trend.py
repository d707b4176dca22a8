"""A linear trend under a Gaussian process, with a vague prior on its coefficients.

y(x) = h(x)'γ + f(x) + noise with h = (1, x) and f of the squared-exponential kernel: explicit
basis functions, Rasmussen and Williams 2006, section 2.7. The trend takes up what is linear, which
for a head is most of it, so that the kernel's lengthscales can follow what bends; the coefficients
are integrated out, so that their doubt stays in every prediction. Everywhere K⁻¹ becomes
P = K⁻¹ - K⁻¹H B H'K⁻¹ with B = (H'K⁻¹H)⁻¹.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from likeme_gaze.checks import FloatArray


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
        coefficients: E[γ] (1 + D,).
        doubt: B = Cov[γ] (1 + D, 1 + D).
        solved: K⁻¹H (n, 1 + D).
    """

    coefficients: FloatArray
    doubt: FloatArray
    solved: FloatArray


class Trends(NamedTuple):
    """The trends of E outputs over the same inputs.

    Attributes:
        basis: h.
        coefficients: E[γ] (E, 1 + D).
        slopes: derivatives of the trends by x (D, E).
        doubt: B = Cov[γ] (E, 1 + D, 1 + D).
        slope_doubt: Cov of an output's slopes, row after row (D D, E).
        solved: K⁻¹H (E, n, 1 + D).
        slope_solved: K⁻¹HB for the slopes alone (E, n, D).
    """

    basis: Basis
    coefficients: FloatArray
    slopes: FloatArray
    doubt: FloatArray
    slope_doubt: FloatArray
    solved: FloatArray
    slope_solved: FloatArray

    def open_variance(
        self, covariance: FloatArray, average: FloatArray, shared: FloatArray
    ) -> FloatArray:
        """What the coefficients' doubt adds to the outputs' variances (E, B).

        With R(x) = h(x) - H'K⁻¹k(x) it is E[R'BR]; the share of Cov[k(x)] is left to the sum over
        all pairs of training inputs, where P stands for K⁻¹.

        Args:
            covariance: of the inputs (B, D, D).
            average: E[R(x)] (E, B, 1 + D).
            shared: tr(Cov[x, k(x)] K⁻¹HB) over the slopes (E, B).
        """
        spread = covariance.reshape(len(covariance), -1) @ self.slope_doubt
        return np.asarray(((average @ self.doubt) * average).sum(axis=-1) + spread.T - 2 * shared)


def trends_of(basis: Basis, trends: Sequence[Trend]) -> Trends:
    """All outputs' trends side by side."""
    coefficients, doubt, solved = (np.stack(part) for part in zip(*trends, strict=True))
    scale = basis.scale
    by_slope = doubt[:, 1:, 1:] / (scale[:, None] * scale)
    return Trends(
        basis,
        coefficients,
        coefficients[:, 1:].T / scale[:, None],
        doubt,
        by_slope.reshape(len(doubt), -1).T,
        solved,
        solved @ doubt[:, :, 1:] / scale,
    )


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
