"""Gaussian processes with several outputs, and what they make of a Gaussian input."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.gaze.beliefs import Gaussian
from likeme_inference.gaze.checks import FloatArray, covariances, numbers
from likeme_inference.gaze.conditioning import Conditioned, condition_on
from likeme_inference.gaze.moment_matching import (
    first_moments,
    pair_sums,
    remaining_variances,
    view,
)

#: Bytes of the (pairs, points, n, n) table one pass works on: enough points to share the small
#: work, few enough for the table to stay in a cache.
TABLE_BYTES = 6_000_000


class Moments(NamedTuple):
    """Moments of the output y for a Gaussian input x; a batch adds leading axes.

    Attributes:
        mean: E[y] (E,).
        covariance: Cov[y] (E, E), noise included.
        input_output_covariance: Cov[x, y] (D, E).
    """

    mean: FloatArray
    covariance: FloatArray
    input_output_covariance: FloatArray


class Regression(NamedTuple):
    """The best linear description of the output for a Gaussian input: y ≈ mean + gain'(x - E[x]).

    Attributes:
        mean: E[y] (..., E).
        gain: Cov[x]⁻¹Cov[x, y] (..., D, E); well defined where Cov[x] is singular.
        covariance: Cov[y] (..., E, E), noise included.
        cross: Cov[x, y] (..., D, E).
    """

    mean: FloatArray
    gain: FloatArray
    covariance: FloatArray
    cross: FloatArray


@dataclass(frozen=True, eq=False)
class GaussianProcesses:
    """E independent Gaussian processes over the same n inputs of D dimensions.

    Attributes:
        inputs: (n, D).
        targets: (n, E).
        log_lengthscales: (E, D).
        log_signal_std: (E,).
        log_noise_std: (E,).
        with_trend: whether a linear trend lies under each output (see trend.py); else the prior
            mean is zero.
    """

    inputs: FloatArray
    targets: FloatArray
    log_lengthscales: FloatArray
    log_signal_std: FloatArray
    log_noise_std: FloatArray
    with_trend: bool = False
    _outputs: Conditioned = field(init=False, repr=False)

    def __post_init__(self) -> None:
        last = np.stack([self.log_signal_std, self.log_noise_std], axis=1)
        logs = np.concatenate([self.log_lengthscales, last], axis=1)
        outputs = condition_on(self.inputs, self.targets, logs, self.with_trend)
        object.__setattr__(self, '_outputs', outputs)

    @classmethod
    def from_hyperparameters(
        cls,
        inputs: ArrayLike,
        targets: ArrayLike,
        log_lengthscales: ArrayLike,
        log_signal_std: ArrayLike,
        log_noise_std: ArrayLike,
        with_trend: bool = False,
    ) -> GaussianProcesses:
        """Condition on training data with given hyperparameters (natural logarithms).

        Args:
            inputs: (n, D).
            targets: (n, E).
            log_lengthscales: (E, D).
            log_signal_std: (E,).
            log_noise_std: (E,).
            with_trend: whether a linear trend lies under each output; without it the prior mean
                is zero.

        Raises:
            ValueError: shapes that do not fit, numbers that are not finite, noise too small for
                the kernel matrix to be positive definite, or inputs that span no trend.
        """
        x = numbers('inputs', inputs, (None, None))
        y = numbers('targets', targets, (len(x), None))
        dimensions, outputs = x.shape[1], y.shape[1]
        return cls(
            x,
            y,
            numbers('log_lengthscales', log_lengthscales, (outputs, dimensions)),
            numbers('log_signal_std', log_signal_std, (outputs,)),
            numbers('log_noise_std', log_noise_std, (outputs,)),
            with_trend,
        )

    @property
    def noise_variance(self) -> FloatArray:
        """σ_n² of each output (E,)."""
        return np.asarray(np.exp(2 * self.log_noise_std))

    def propagate(self, mean: ArrayLike, covariance: ArrayLike) -> Moments:
        """Exact moments of the output for an input N(mean, covariance).

        Args:
            mean: (D,), or (..., D) for a batch.
            covariance: (D, D) or (..., D, D), positive semidefinite; zero is a known input.

        Raises:
            ValueError: shapes that do not fit, numbers that are not finite, no covariance.
        """
        width = self.inputs.shape[1]
        batch = np.shape(mean)[:-1]
        at = numbers('mean', mean, (*batch, width))
        spread = covariances('covariance', covariance, (*batch, width, width))
        found = self.regress(at, spread)
        return Moments(found.mean, found.covariance, found.cross)

    def regress(self, mean: FloatArray, covariance: FloatArray) -> Regression:
        """The same moments as `propagate`, as a linear regression; its arguments unchecked."""
        *batch, width = mean.shape
        at, spread = mean.reshape(-1, width), covariance.reshape(-1, width, width)
        parts = [self._regress(at[rows], spread[rows]) for rows in _rows(len(at), self._outputs)]
        whole = [np.concatenate(c) if len(c) > 1 else c[0] for c in zip(*parts, strict=True)]
        return Regression(*(array.reshape(*batch, *array.shape[1:]) for array in whole))

    def negative_log_marginal_likelihood(self) -> FloatArray:
        """-log p(targets | inputs, hyperparameters) of each output (E,)."""
        return -self._outputs.log_likelihood

    def _regress(self, mean: FloatArray, covariance: FloatArray) -> Regression:
        at, outputs = Gaussian(mean, covariance), self._outputs
        seen = view(self.inputs, outputs, at)
        means, cross, gains = first_moments(seen, outputs)
        count = len(means)
        spread = np.zeros((count, count, len(mean)))
        # Of a known input nothing spreads: no table over all pairs of training inputs is needed.
        if covariance.any():
            sums = pair_sums(seen, outputs)
            spread[outputs.first, outputs.second] = spread[outputs.second, outputs.first] = sums
        own = np.arange(count)
        spread[own, own] += remaining_variances(seen, outputs, at)
        spread[own, own] = np.maximum(spread[own, own], 0) + self.noise_variance[:, None]
        found = Regression(
            means.T,
            np.moveaxis(gains, 0, -1),
            np.moveaxis(spread, -1, 0),
            np.moveaxis(cross, 0, -1),
        )
        return self._with_trends(found, at) if self.with_trend else found

    def _with_trends(self, found: Regression, at: Gaussian) -> Regression:
        """Means, gains and covariances of the outputs once their trends are added."""
        trends = self._outputs.trends
        slopes = np.stack([trend.slope for trend in trends], axis=-1)
        moved = at.covariance @ slopes
        mixed = slopes.T @ (found.cross + moved / 2)
        return Regression(
            found.mean + np.stack([trend.mean(at.mean) for trend in trends], axis=-1),
            found.gain + slopes,
            found.covariance + mixed + np.swapaxes(mixed, -1, -2),
            found.cross + moved,
        )


def _rows(points: int, outputs: Conditioned) -> list[slice]:
    """Slices of a batch whose tables over all pairs of inputs fit into the cache."""
    step = max(1, TABLE_BYTES // (8 * outputs.tables.size))
    return [slice(start, start + step) for start in range(0, points, step)] or [slice(0, 0)]
