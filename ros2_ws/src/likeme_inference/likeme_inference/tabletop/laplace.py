"""Gaussian process over the log odds of success, given counts: Laplace's approximation.

Each row r has a latent value z_r, p_r = 1 / (1 + exp(-z_r)), and y_r successes in n_r trials. With
the prior z ~ N(0, K) the posterior is approximated by the Gaussian of mode and curvature of

    log p(y | z) - z' K^-1 z / 2,    W_r = -d2 log p(y_r | z_r) / dz_r^2 = n_r p_r (1 - p_r),

found by Newton's method (Williams and Barber 1998; Rasmussen and Williams 2006, section 3.4).
The cost is cubic in the number of rows.
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
    """The approximate posterior of the latent values of R rows.

    Attributes:
        mode: shape [R].
        weights: K^-1 mode, the gradient of log p(y | z) there, shape [R].
        curvature: the diagonal of W, shape [R].
        precision: G = (K + W^-1)^-1, shape [R, R]; the covariance is K - K G K.
        evidence: log p(y | K) of the trials in their order, nats.
    """

    mode: FloatArray
    weights: FloatArray
    curvature: FloatArray
    precision: FloatArray
    evidence: float


def laplace(kernel: FloatArray, successes: FloatArray, trials: FloatArray) -> LatentPosterior:
    """The posterior of the latent values.

    Args:
        kernel: K, positive definite, shape [R, R].
        successes: y, shape [R].
        trials: n, shape [R].
    """
    weights, mode, best = np.zeros(len(kernel)), np.zeros(len(kernel)), -np.inf
    for _ in range(STEPS):
        p = _success(mode)
        curvature = trials * p * (1 - p)
        target = curvature * mode + successes - trials * p
        step = np.linalg.solve(_system(kernel, curvature), target) - weights
        before = best
        for halving in range(HALVINGS):
            tried = weights + step / 2**halving
            moved = kernel @ tried
            likelihood = successes * moved - trials * np.logaddexp(0.0, moved)
            best = float(likelihood.sum() - tried @ moved / 2)
            if best >= before:
                break
        weights, mode = tried, moved
        if abs(best - before) < ENOUGH:
            break
    p = _success(mode)
    curvature = trials * p * (1 - p)
    system = _system(kernel, curvature)
    return LatentPosterior(
        mode,
        weights,
        curvature,
        np.asarray(np.linalg.solve(system, np.diag(curvature)), dtype=np.float64),
        best - float(np.linalg.slogdet(system)[1]) / 2,
    )


def _success(z: FloatArray) -> FloatArray:
    return np.asarray(1 / (1 + np.exp(-z)))


def _system(kernel: FloatArray, curvature: FloatArray) -> FloatArray:
    """I + W K."""
    return np.asarray(np.eye(len(kernel)) + curvature[:, None] * kernel)
