"""Σ_ij w_ij q_ai q_bj expm1(e_ij) over all pairs of training inputs: where the time goes.

With q and e of moment_matching and d_i = x_i - m, and a Gaussian input N(m, S),

    e_ij = ½ log|I + W'W| + y_i·t_j - ½|y_i|² - ½|r_j|²
    TT' = Λ_b + S_a,  y_i = T⁻¹ S_a Λ_a⁻¹ d_i,  t_j = T⁻¹ d_j,  W = T⁻¹ S L'⁻¹,
    r_j = (I + W'W)^-½ W' t_j

so that e is a product of matrices of D + 2 columns, and what is left for each of the n² pairs is
one expm1 and one or two multiplications, in tables small enough to stay in the cache. For a = b
the table is symmetric, and half of it is enough (pair_blocks).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_gaze.checks import FloatArray
from likeme_gaze.conditioning import Conditioned
from likeme_gaze.moment_matching import View
from likeme_gaze.triangular import cholesky, solve_lower, transposed

#: Above this e_ij the product q_i q_j expm1(e_ij) is formed in the log domain: q could be 0.
LARGE = 30.0
#: Bytes of the (points, n, n) table that is worked on at a time: what a second-level cache holds.
TABLE_BYTES = 400_000


class Exponents(NamedTuple):
    """e_ij = left_i·right_j of every pair of outputs; K = D + 2.

    Attributes:
        left, right: (P, B, K, n).
        bound: what no e_ij exceeds (P, B).
    """

    left: FloatArray
    right: FloatArray
    bound: FloatArray


def pair_sums(seen: View, outputs: Conditioned) -> FloatArray:
    """Σ_ij w_ij q_ai q_bj expm1(e_ij) of every pair of outputs (P, B).

    With w = β_a β_b' this is Cov[m_a(x), m_b(x)]; an output's own table has K⁻¹ taken off, which
    adds how much of its variance varies with x.
    """
    found = exponents(seen, outputs)
    large = found.bound > LARGE
    if not large.any():
        return _direct(found, seen, outputs)
    with np.errstate(over='ignore', invalid='ignore'):
        sums = _direct(found, seen, outputs)
    for pair, point in np.argwhere(large):
        sums[pair, point] = _in_logs(found, seen, outputs, pair, point)
    return sums


def _direct(found: Exponents, seen: View, outputs: Conditioned) -> FloatArray:
    own, blocks = len(outputs.weights), outputs.blocks
    half = _cut(found.left[:own], blocks.rows), _cut(found.right[:own], blocks.columns)
    q = seen.q.take(blocks.rows, axis=-1), seen.q.take(blocks.columns, axis=-1)
    sums = _contracted(half, q, outputs.tables)
    if own == 1:
        return sums
    weighted = (outputs.weights[:, None] * seen.q)[:, :, None]
    ends = weighted[outputs.first[own:]], weighted[outputs.second[own:]]
    whole = found.left[own:, :, None], found.right[own:, :, None]
    return np.concatenate([sums, _contracted(whole, ends, None)])


def _cut(factors: FloatArray, at: NDArray[np.intp]) -> FloatArray:
    """Factors (P, B, K, n) in rectangles (P, B, m, K, width)."""
    return factors.take(at, axis=-1).swapaxes(2, 3)


def _contracted(
    factors: tuple[FloatArray, FloatArray],
    ends: tuple[FloatArray, FloatArray],
    tables: FloatArray | None,
) -> FloatArray:
    """Σ u_i w_ij v_j expm1(e_ij) over all rectangles (P, B).

    Args:
        factors: of e, (P, B, m, K, s) and (P, B, m, K, w).
        ends: u (P, B, m, s) and v (P, B, m, w).
        tables: w (P, m, s, w), or None where u and v say all.
    """
    left, right = factors[0].swapaxes(-1, -2), factors[1]
    u = ends[0][..., None, :]
    inner = np.empty((*right.shape[:3], 1, right.shape[-1]))
    step = max(1, TABLE_BYTES // (8 * math.prod(left.shape[2:4]) * right.shape[-1]))
    for pair in range(len(left)):
        for start in range(0, left.shape[1], step):
            part = pair, slice(start, start + step)
            excess = left[part] @ right[part]
            np.expm1(excess, out=excess)
            if tables is not None:
                excess *= tables[pair]
            np.matmul(u[part], excess, out=inner[part])
    inner = inner[..., 0, :]
    inner *= ends[1]
    return np.asarray(inner.sum(axis=(-2, -1)))


def _in_logs(
    found: Exponents, seen: View, outputs: Conditioned, pair: int, point: int
) -> FloatArray:
    """One sum, where a q may be too small, or an e_ij too great, for a number."""
    a, b = outputs.first[pair], outputs.second[pair]
    rows, columns = outputs.blocks if a == b else outputs.whole
    left, right = (f[pair, point] for f in found[:2])
    excess = left[:, rows].transpose(1, 2, 0) @ right[:, columns].swapaxes(0, 1)
    base = seen.log_q[a, point, rows, None] + seen.log_q[b, point, columns][:, None]
    near = np.exp(base) * np.expm1(np.minimum(excess, LARGE))
    products = np.where(excess > LARGE, np.exp(base + np.maximum(excess, LARGE)), near)
    weights = outputs.weights
    table = outputs.tables[a] if a == b else np.outer(weights[a], weights[b])
    return np.asarray((products * table).sum())


def exponents(seen: View, outputs: Conditioned) -> Exponents:
    """e_ij of every pair of outputs as a product."""
    a = outputs.first
    width, count = seen.distance.shape[-2:]
    lower = cholesky(seen.tilted[a] + outputs.second_kernels)
    right = np.empty((*seen.pull.shape[:-1], 3 * width))
    right[..., :width], right[..., width : 2 * width] = seen.pull, outputs.identity
    right[..., 2 * width :] = transposed(seen.shrink)
    solved = solve_lower(lower, right[a])
    shared = transposed(solved[..., 2 * width :])
    overlap = shared @ solved[..., 2 * width :]
    # -½ d'[(Λ_b + S_a)⁻¹ - (Λ_b + S)⁻¹]d of every training input, by Woodbury; with W'W = QVQ'
    # |r_j|² = |(I + V)^-½ Q'W't_j|².
    values, axes = np.linalg.eigh(overlap)
    values = np.maximum(values, 0)
    volume = 0.5 * np.log1p(values).sum(axis=-1)
    inner = (transposed(axes) @ shared) @ solved[..., width : 2 * width]
    inner /= np.sqrt(1 + values)[..., None]
    maps = np.concatenate([solved[..., :width], solved[..., width : 2 * width], inner], axis=-2)
    vectors = (maps @ seen.distance).reshape(*volume.shape, 3, width, count)
    halves = 0.5 * (vectors**2).sum(axis=-2)
    factors = np.ones((2, *volume.shape, width + 2, count))
    factors[..., :width, :] = np.moveaxis(vectors[:, :, :2], 2, 0)
    np.negative(halves[:, :, 0], out=factors[0, :, :, width])
    np.subtract(volume[..., None], halves[:, :, 2], out=factors[1, :, :, width + 1])
    longest = halves[:, :, :2].max(axis=-1, initial=0.0).prod(axis=-1)
    return Exponents(factors[0], factors[1], 2 * np.sqrt(longest) + volume)
