"""What training data and hyperparameters make of Gaussian processes, computed once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_gaze.checks import FloatArray
from likeme_gaze.kernel import (
    factor,
    gram,
    negative_log_likelihood,
    precision,
    solve,
    squared_distances,
)
from likeme_gaze.pair_blocks import PairBlocks, each_pair_once, every_pair
from likeme_gaze.trend import (
    Basis,
    Trend,
    Trends,
    basis_for,
    coefficients_doubt,
    trends_of,
)


class Conditioned(NamedTuple):
    """E outputs and their P = E (E + 1) / 2 pairs a <= b, those with a = b first.

    Attributes (m = 1 + D with trends, else 0):
        squares: squared lengthscales (E, D).
        kernels: Λ, the same as diagonal matrices (E, 1, D, D).
        signal_variance, noise_variance: σ_f² and σ_n² (E,).
        log_peak: log σ_f² + ½ log|Λ| (E,).
        lowers: Cholesky factors of the kernel matrices with noise (E, n, n).
        weights: β = K⁻¹y (E, n), of what the trend leaves of y where there is one.
        trends: those of all outputs, or none.
        by_q: what E[k(x)] is summed with: β, and K⁻¹H where there are trends (E, n, 1 + m).
        by_pull: what Cov[x, k(x)] is summed with: β, and K⁻¹HB of the slopes (E, n, 1 or 1 + D).
        log_likelihood: log p(y | X) (E,).
        first, second: the outputs a and b of each pair (P,).
        pair: which pair two outputs are (E, E).
        second_kernels: Λ of each pair's second output (P, 1, D, D).
        identity: (D, D).
        whole: every pair of training inputs, in one rectangle.
        blocks: how the pairs of training inputs are gone through where a = b.
        tables: ββ' - K⁻¹ of each output in these blocks; with a trend, P stands for K⁻¹.
    """

    squares: FloatArray
    kernels: FloatArray
    signal_variance: FloatArray
    noise_variance: FloatArray
    log_peak: FloatArray
    lowers: FloatArray
    weights: FloatArray
    trends: Trends | None
    by_q: FloatArray
    by_pull: FloatArray
    log_likelihood: FloatArray
    first: NDArray[np.intp]
    second: NDArray[np.intp]
    pair: NDArray[np.intp]
    second_kernels: FloatArray
    identity: FloatArray
    whole: PairBlocks
    blocks: PairBlocks
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
    trends = None
    if basis is not None:
        trends = trends_of(basis, [o.trend for o in outputs if o.trend is not None])
    return _conditioned(logs, outputs, trends)


def _conditioned(logs: FloatArray, outputs: list[_Output], trends: Trends | None) -> Conditioned:
    squares = np.exp(2 * logs[:, :-2])
    weights = np.array([output.weights for output in outputs])
    blocks = each_pair_once(weights.shape[1])
    tables = [blocks.folded(np.outer(o.weights, o.weights) - o.inverse) for o in outputs]
    apart = np.triu_indices(len(outputs), 1)
    first, second = (np.append(np.arange(len(outputs)), end) for end in apart)
    pair = np.empty((len(outputs), len(outputs)), dtype=np.intp)
    pair[first, second] = pair[second, first] = np.arange(len(first))
    kernels = squares[:, None, :, None] * np.eye(squares.shape[1])
    column = weights[:, :, None]
    return Conditioned(
        squares,
        kernels,
        np.exp(2 * logs[:, -2]),
        np.exp(2 * logs[:, -1]),
        2 * logs[:, -2] + logs[:, :-2].sum(axis=1),
        np.array([output.lower for output in outputs]),
        weights,
        trends,
        column if trends is None else np.concatenate([column, trends.solved], axis=-1),
        column if trends is None else np.concatenate([column, trends.slope_solved], axis=-1),
        np.array([output.log_likelihood for output in outputs]),
        first,
        second,
        pair,
        kernels[second],
        np.eye(squares.shape[1]),
        every_pair(weights.shape[1]),
        blocks,
        np.array(tables),
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
        trend = Trend(doubt @ (solved.T @ target), doubt, solved)
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
