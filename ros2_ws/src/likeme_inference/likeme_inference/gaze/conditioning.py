"""What training data and hyperparameters make of Gaussian processes, computed once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_inference.gaze.checks import FloatArray
from likeme_inference.gaze.kernel import (
    factor,
    gram,
    negative_log_likelihood,
    precision,
    solve,
    squared_distances,
)
from likeme_inference.gaze.trend import Basis, Trend, basis_for, coefficients_doubt


class Conditioned(NamedTuple):
    """E outputs and their P = E (E + 1) / 2 pairs a <= b.

    Attributes:
        squares: squared lengthscales (E, D).
        log_signal_variance: log σ_f² (E,).
        lowers: Cholesky factors of the kernel matrices with noise (E, n, n).
        weights: β = K⁻¹y (E, n), of what the trend leaves of y where there is one.
        trends: one for each output, or none.
        log_likelihood: log p(y | X) (E,).
        first, second: the outputs a and b of each pair (P,).
        tables: β_a β_b', less K⁻¹ for a = b (P, n, n); with a trend, P stands for K⁻¹.
    """

    squares: FloatArray
    log_signal_variance: FloatArray
    lowers: FloatArray
    weights: FloatArray
    trends: tuple[Trend, ...]
    log_likelihood: FloatArray
    first: NDArray[np.intp]
    second: NDArray[np.intp]
    tables: FloatArray


class _Output(NamedTuple):
    """One output: its Cholesky factor, β, K⁻¹ or P, trend, and log p(y | X)."""

    lower: FloatArray
    weights: FloatArray
    inverse: FloatArray
    trend: Trend | None
    log_likelihood: float


def condition_on(
    inputs: FloatArray, targets: FloatArray, logs: FloatArray, with_trend: bool
) -> Conditioned:
    """Condition every output on the training data.

    Args:
        inputs: (n, D).
        targets: (n, E).
        logs: log hyperparameters of each output (E, D + 2), in the order of `kernel`.
        with_trend: whether a linear trend lies under each output.

    Raises:
        ValueError: noise too small for a positive definite matrix, or inputs that span no trend.
    """
    distances = squared_distances(inputs), squared_distances(inputs.astype(np.longdouble))
    basis = basis_for(inputs) if with_trend else None
    columns = None if basis is None else basis.of(inputs)
    outputs = [
        _condition(distances, target, log_all, basis, columns)
        for target, log_all in zip(targets.T, logs, strict=True)
    ]
    first, second = np.triu_indices(len(outputs))
    weights = np.array([output.weights for output in outputs])
    tables = weights[first, :, None] * weights[second, None, :]
    for e, output in enumerate(outputs):
        tables[(first == e) & (second == e)] -= output.inverse
    return Conditioned(
        np.exp(2 * logs[:, :-2]),
        2 * logs[:, -2],
        np.array([output.lower for output in outputs]),
        weights,
        tuple(output.trend for output in outputs if output.trend is not None),
        np.array([output.log_likelihood for output in outputs]),
        first,
        second,
        tables,
    )


def _condition(
    distances: tuple[FloatArray, NDArray[np.longdouble]],
    target: FloatArray,
    log_all: FloatArray,
    basis: Basis | None,
    columns: FloatArray | None,
) -> _Output:
    lower = factor(gram(distances[0], log_all), float(log_all[-1]))
    inverse, trend, size, rest = precision(lower), None, (0, 0.0), target
    if basis is not None and columns is not None:
        solved, doubt, volume = coefficients_doubt(lower, columns)
        trend = Trend(basis, doubt @ (solved.T @ target), doubt, solved)
        inverse -= solved @ doubt @ solved.T
        rest, size = target - columns @ trend.coefficients, (len(doubt), float(volume))
    weights = _refined_weights(lower, distances[1], log_all, rest)
    likelihood = -negative_log_likelihood(lower, weights, target, size)
    return _Output(lower, weights, inverse, trend, likelihood)


def _refined_weights(
    lower: FloatArray, squared: NDArray[np.longdouble], log_all: FloatArray, target: FloatArray
) -> FloatArray:
    """K⁻¹y with the residual in extended precision: what K's condition costs is won back."""
    extended = log_all.astype(np.longdouble)
    matrix = gram(squared, extended)
    matrix[np.diag_indices_from(matrix)] += np.exp(2 * extended[-1])
    weights = np.zeros(len(target), dtype=np.longdouble)
    for _ in range(3):
        residual = (target - matrix @ weights).astype(np.float64)
        weights += solve(lower, residual)
    return np.asarray(weights.astype(np.float64))
