"""Gaussian beliefs as values."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from likeme_gaze.checks import FloatArray, covariances, numbers


class Gaussian(NamedTuple):
    """N(mean, covariance).

    Attributes:
        mean: (..., D).
        covariance: (..., D, D).
    """

    mean: FloatArray
    covariance: FloatArray

    def part(self, start: int, stop: int) -> Gaussian:
        """The marginal of coordinates start to stop - 1."""
        inside = slice(start, stop)
        return Gaussian(self.mean[..., inside], self.covariance[..., inside, inside])


def known(value: ArrayLike) -> Gaussian:
    """A belief without doubt: mean `value` (..., D), covariance 0."""
    mean = np.asarray(value, dtype=np.float64)
    return Gaussian(mean, np.zeros((*mean.shape, mean.shape[-1])))


def checked(name: str, belief: Gaussian, width: int) -> Gaussian:
    """The same belief over `width` coordinates as fresh arrays.

    Raises:
        ValueError: shapes that do not fit, numbers that are not finite, no covariance.
    """
    batch = np.shape(belief.mean)[:-1]
    return Gaussian(
        numbers(f'the mean of {name}', belief.mean, (*batch, width)),
        covariances(f'the covariance of {name}', belief.covariance, (*batch, width, width)),
    )


def independent(first: Gaussian, second: Gaussian) -> Gaussian:
    """The joint belief of two that know nothing of each other."""
    empty = np.zeros((*first.mean.shape, second.mean.shape[-1]))
    return coupled(first, second, empty)


def coupled(first: Gaussian, second: Gaussian, cross: FloatArray) -> Gaussian:
    """The joint belief of two with Cov[first, second] = `cross`."""
    upper = np.concatenate([first.covariance, cross], axis=-1)
    lower = np.concatenate([np.swapaxes(cross, -1, -2), second.covariance], axis=-1)
    return Gaussian(
        np.concatenate([first.mean, second.mean], axis=-1), np.concatenate([upper, lower], axis=-2)
    )


def condition(
    belief: Gaussian, seen: Gaussian, cross: FloatArray, observed: FloatArray
) -> Gaussian:
    """The belief after `observed`, predicted as `seen` with Cov[belief, seen] = `cross`.

    mean + C S⁻¹ (observed - E[seen]) and covariance - C S⁻¹ C', by the Cholesky factor of S.
    """
    lower = np.linalg.cholesky(seen.covariance)
    away = np.broadcast_to(observed - seen.mean, (*cross.shape[:-2], cross.shape[-1]))
    right = np.concatenate([cross, away[..., None, :]], axis=-2).swapaxes(-1, -2)
    solved = np.linalg.solve(lower, right)
    gain, surprise = solved[..., :-1], solved[..., -1:]
    flipped = gain.swapaxes(-1, -2)
    return Gaussian(
        belief.mean + (flipped @ surprise)[..., 0], symmetric(belief.covariance - flipped @ gain)
    )


def mixture(parts: Gaussian, weights: FloatArray) -> Gaussian:
    """The Gaussian with the moments of a mixture of `parts` (K, ..., D), weights (K, ...)."""
    mean = (weights[..., None] * parts.mean).sum(axis=0)
    away = parts.mean - mean
    spread = parts.covariance + away[..., :, None] * away[..., None, :]
    return Gaussian(mean, (weights[..., None, None] * spread).sum(axis=0))


def symmetric(matrix: FloatArray) -> FloatArray:
    """The symmetric part of a matrix, or of a batch of them."""
    return np.asarray((matrix + matrix.swapaxes(-1, -2)) / 2)


def mahalanobis(belief: Gaussian, point: FloatArray) -> FloatArray:
    """Squared Mahalanobis distance of `point` (..., D) from the mean (...)."""
    lower = np.linalg.cholesky(belief.covariance)
    scaled = np.linalg.solve(lower, (point - belief.mean)[..., None])
    return np.asarray((scaled[..., 0] ** 2).sum(axis=-1))
