"""Hyperparameters by marginal likelihood: several starts, bounds, and a floor under the noise."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from likeme_gaze.checks import FloatArray, numbers
from likeme_gaze.gaussian_processes import GaussianProcesses
from likeme_gaze.kernel import likelihood_and_gradient, squared_distances
from likeme_gaze.trend import basis_for

#: Fewer points than this say nothing about a signal, a noise and a lengthscale per input.
FEWEST_POINTS = 5


class Search(NamedTuple):
    """Where hyperparameters are looked for, in units of the data's own standard deviations.

    Attributes:
        lengthscale: least and greatest lengthscale.
        typical: median and logarithmic standard deviation of the lengthscales' log-normal prior.
        signal: least and greatest signal standard deviation.
        noise: least and greatest noise standard deviation; the least is the floor that keeps the
            kernel matrix well conditioned when an output has no noise.
        starts: (lengthscale, signal, noise) of each start of the optimiser; the best end wins.
        iterations: limit of each run.
    """

    lengthscale: tuple[float, float] = (0.1, 100.0)
    typical: tuple[float, float] = (1.0, 0.5)
    signal: tuple[float, float] = (0.01, 100.0)
    noise: tuple[float, float] = (3e-3, 2.0)
    starts: tuple[tuple[float, float, float], ...] = ((2.0, 1.0, 0.3), (5.0, 3.0, 0.1))
    iterations: int = 100


def fit(inputs: ArrayLike, targets: ArrayLike, search: Search | None = None) -> GaussianProcesses:
    """Gaussian processes with the hyperparameters that make the training data most likely.

    A linear trend with a vague prior lies under each output, so targets need no centring. Without
    it the kernel would have to explain the average and the linear part as signal, by a large
    signal and long lengthscales that then smooth away what bends.

    Args:
        inputs: (n, D).
        targets: (n, E).
        search: bounds and starts.

    Raises:
        ValueError: fewer than FEWEST_POINTS points, shapes that do not fit, numbers not finite.
    """
    x = numbers('inputs', inputs, (None, None))
    y = numbers('targets', targets, (len(x), None))
    if len(x) < FEWEST_POINTS:
        raise ValueError(f'Expected at least {FEWEST_POINTS} training points, got {len(x)}.')
    x_scale, y_scale = _scale(x), _scale(y)
    data = squared_distances(x / x_scale), basis_for(x).of(x)
    found = np.array([_best(*data, target, search or Search()) for target in (y / y_scale).T])
    return GaussianProcesses.from_hyperparameters(
        x,
        y,
        found[:, :-2] + np.log(x_scale),
        found[:, -2] + np.log(y_scale),
        found[:, -1] + np.log(y_scale),
        with_trend=True,
    )


def _scale(columns: FloatArray) -> FloatArray:
    """Standard deviation of each column, 1 where it is constant."""
    deviation = columns.std(axis=0)
    return np.where(deviation > 0, deviation, 1.0)


def _best(
    squared: FloatArray, columns: FloatArray, target: FloatArray, search: Search
) -> FloatArray:
    """The most likely log hyperparameters over all starts."""
    ends = list(_ends((squared, target, columns), search))
    return min(ends, key=lambda end: end[0])[1]


def _ends(
    data: tuple[FloatArray, FloatArray, FloatArray], search: Search
) -> Iterator[tuple[float, FloatArray]]:
    dimensions = len(data[0])
    limits = [*[search.lengthscale] * dimensions, search.signal, search.noise]
    for lengthscale, signal, noise in search.starts:
        start = np.log([*[lengthscale] * dimensions, signal, noise])
        end = optimize.minimize(
            _penalised,
            start,
            (search, *data),
            method='L-BFGS-B',
            jac=True,
            bounds=np.log(limits),
            options={'maxiter': search.iterations},
        )
        yield float(end.fun), np.asarray(end.x)


def _penalised(
    log_hyperparameters: FloatArray, search: Search, *data: FloatArray
) -> tuple[float, FloatArray]:
    """-log of marginal likelihood times the lengthscales' prior, and its gradient."""
    value, gradient = likelihood_and_gradient(log_hyperparameters, *data)
    median, deviation = search.typical
    off = (log_hyperparameters[:-2] - np.log(median)) / deviation
    gradient[:-2] += off / deviation
    return value + 0.5 * float(off @ off), gradient
