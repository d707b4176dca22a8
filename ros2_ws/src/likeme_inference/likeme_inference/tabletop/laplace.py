"""Gaussian process over the log odds of outcomes, given their counts: Laplace's approximation.

Each row r of outcomes has latent values z_r, p_r = softmax(z_r), and counts y_r. With the prior
z ~ N(0, K) the posterior is approximated by the Gaussian of mode and curvature of

    log p(y | z) - z' K^-1 z / 2,
    W_r = -d2 log p(y_r | z_r) / dz_r^2 = n_r (diag p_r - p_r p_r'),

found by Newton's method (Williams and Barber 1998; Rasmussen and Williams 2006, section 3.5).
The cost is cubic in the number of latent values.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray

#: Newton steps, and the change of the objective (nats) that ends them.
STEPS, ENOUGH = 40, 1e-7
#: Halvings of a Newton step that does not improve the objective.
HALVINGS = 20


class LatentPosterior(NamedTuple):
    """The approximate posterior of the latent values of R rows of F outcomes.

    Attributes:
        mode: shape [R, F].
        weights: K^-1 mode, the gradient of log p(y | z) there, shape [R, F].
        curvature: W, shape [R, F, F].
        precision: G = (K + W^-1)^-1, shape [R F, R F]; the covariance is K - K G K.
        evidence: log p(y | K) of the trials in their order, nats.
    """

    mode: FloatArray
    weights: FloatArray
    curvature: FloatArray
    precision: FloatArray
    evidence: float


def laplace(kernel: FloatArray, counts: FloatArray) -> LatentPosterior:
    """The posterior of the latent values.

    Args:
        kernel: K, positive definite, shape [R F, R F].
        counts: y, shape [R, F].
    """
    trials = counts.sum(axis=-1)
    weights = np.zeros(counts.size)
    log_p = np.full(counts.shape, -np.log(counts.shape[-1]))
    mode, best = weights, float((counts * log_p).sum())
    for _ in range(STEPS):
        p = np.exp(log_p)
        curvature = _curvature(p, trials)
        gradient = counts - trials[:, None] * p
        target = np.einsum('rfg,rg->rf', curvature, mode.reshape(counts.shape)) + gradient
        step = np.linalg.solve(_system(kernel, curvature), target.ravel()) - weights
        before = best
        for halving in range(HALVINGS):
            tried = weights + step / 2**halving
            moved = kernel @ tried
            log_p = log_softmax(moved.reshape(counts.shape))
            best = float((counts * log_p).sum() - tried @ moved / 2)
            if best >= before:
                break
        weights, mode = tried, moved
        if abs(best - before) < ENOUGH:
            break
    curvature = _curvature(np.exp(log_p), trials)
    system = _system(kernel, curvature)
    shape = counts.shape
    return LatentPosterior(
        mode.reshape(shape),
        weights.reshape(shape),
        curvature,
        np.asarray(np.linalg.solve(system, _block_diagonal(curvature)), dtype=np.float64),
        best - float(np.linalg.slogdet(system)[1]) / 2,
    )


def log_softmax(z: FloatArray) -> FloatArray:
    """Logarithm of the probabilities along the last axis."""
    high = z.max(axis=-1, keepdims=True)
    return np.asarray(z - high - np.log(np.exp(z - high).sum(axis=-1, keepdims=True)))


def _curvature(p: FloatArray, trials: FloatArray) -> FloatArray:
    """W, shape [R, F, F]."""
    diagonal = np.eye(p.shape[-1]) * p[:, :, None]
    return np.asarray(trials[:, None, None] * (diagonal - p[:, :, None] * p[:, None, :]))


def _system(kernel: FloatArray, curvature: FloatArray) -> FloatArray:
    """I + W K."""
    rows, outcomes, _ = curvature.shape
    product = curvature @ kernel.reshape(rows, outcomes, rows * outcomes)
    return np.asarray(np.eye(rows * outcomes) + product.reshape(kernel.shape))


def _block_diagonal(blocks: FloatArray) -> FloatArray:
    rows, outcomes, _ = blocks.shape
    whole = np.zeros((rows, outcomes, rows, outcomes))
    whole[np.arange(rows), :, np.arange(rows)] = blocks
    return whole.reshape(rows * outcomes, rows * outcomes)
