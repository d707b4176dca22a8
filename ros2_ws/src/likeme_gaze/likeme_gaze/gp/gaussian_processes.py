"""Gaussian processes with several outputs, and their exact moments for Gaussian inputs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from likeme_gaze.beliefs import Gaussian
from likeme_gaze.checks import FloatArray, covariances, numbers
from likeme_gaze.gp.conditioning import Conditioned, condition_on
from likeme_gaze.gp.moment_matching import first_moments, kernel_expectation
from likeme_gaze.gp.pair_sums import pair_sums
from likeme_gaze.gp.trend import Trends

#: Training inputs times batch points per pass: enough to amortise overhead, few enough for the
#: cache.
PASS_SIZE = 8_000


class OutputMoments(NamedTuple):
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
    """Linear regression of the output on a Gaussian input: y ≈ mean + gain'(x - E[x]).

    Attributes:
        mean: E[y] (..., E).
        gain: Cov[x]⁻¹Cov[x, y] (..., D, E); defined for singular Cov[x] too.
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
        with_trend: whether each output has a linear trend (see trend.py) instead of a zero mean.
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
            with_trend: whether each output has a linear trend instead of a zero mean.

        Raises:
            ValueError: wrong shapes, values that are not finite, noise too small for a positive
                definite kernel matrix, or inputs that do not determine the trend.
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
        return self._outputs.noise_variance

    def propagate(self, mean: ArrayLike, covariance: ArrayLike) -> OutputMoments:
        """Exact moments of the output for an input N(mean, covariance).

        Args:
            mean: (D,), or (..., D) for a batch.
            covariance: (D, D) or (..., D, D), positive semidefinite; zero for a known input.

        Raises:
            ValueError: wrong shapes, values that are not finite, or an invalid covariance.
        """
        width = self.inputs.shape[1]
        batch = np.shape(mean)[:-1]
        at = numbers('mean', mean, (*batch, width))
        spread = covariances('covariance', covariance, (*batch, width, width))
        found = self.regress(at, spread)
        return OutputMoments(found.mean, found.covariance, found.cross)

    def regress(self, mean: FloatArray, covariance: FloatArray) -> Regression:
        """The moments of `propagate` as a linear regression; arguments are not validated."""
        *batch, width = mean.shape
        at, spread = mean.reshape(-1, width), covariance.reshape(-1, width, width)
        parts = [self._regress(at[rows], spread[rows]) for rows in _rows(len(at), self._outputs)]
        whole = parts[0] if len(parts) == 1 else map(np.concatenate, zip(*parts, strict=True))
        return Regression(*(array.reshape(*batch, *array.shape[1:]) for array in whole))

    def _regress(self, mean: FloatArray, covariance: FloatArray) -> Regression:
        at, outputs = Gaussian(mean, covariance), self._outputs
        seen = kernel_expectation(self.inputs, outputs, at)
        first = first_moments(seen, outputs, at)
        count = len(first.mean)
        # A known input has no spread; the sum over pairs of training inputs is skipped.
        if covariance.any():
            spread = pair_sums(seen, outputs)[outputs.pair].transpose(2, 0, 1)
        else:
            spread = np.zeros((len(mean), count, count))
        variances = np.einsum('bee->be', spread)
        variances += first.variance.T
        np.maximum(variances, 0, out=variances)
        variances += outputs.noise_variance
        gain, cross = first.gain.transpose(1, 2, 0), first.cross.transpose(1, 2, 0)
        found = Regression(first.mean.T, gain, spread, cross)
        return found if outputs.trends is None else _with_trends(found, at, outputs.trends)


def _with_trends(found: Regression, at: Gaussian, trends: Trends) -> Regression:
    """Gains and covariances of the outputs with their trends added."""
    moved = at.covariance @ trends.slopes
    mixed = trends.slopes.T @ (found.cross + moved / 2)
    return Regression(
        found.mean,
        found.gain + trends.slopes,
        found.covariance + mixed + mixed.swapaxes(-1, -2),
        found.cross + moved,
    )


def _rows(points: int, outputs: Conditioned) -> list[slice]:
    """Slices of a batch whose vectors over all training inputs fit the cache."""
    step = max(1, PASS_SIZE // outputs.weights.shape[1])
    return [slice(start, start + step) for start in range(0, points, step)] or [slice(0, 0)]
