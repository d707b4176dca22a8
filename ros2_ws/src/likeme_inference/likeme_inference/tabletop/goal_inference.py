"""Inference of the goal of a demonstrated change of state (Fig 3b, 3c, 3d; Fig 8a).

All functions are pure and work for any number of states, actions and goals. Axes are named:
transition[x_i, a, x_f], goals[g, x_f] (1 where x_f fulfils g), policy[x_i, g, a], prior[g].
Leading axes before these (objects, models) are batch axes. No result is NaN: a change that is
impossible under a model leaves the prior.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import FloatArray

#: Relative difference up to which probabilities are equal: rounding of the same sum.
TIE = 1e-12


def map_index(probability: ArrayLike, prefer: tuple[int, ...] = ()) -> int:
    """Index of the greatest probability (MAP).

    Ties (relative difference up to TIE) go to the first of `prefer` that is among the greatest,
    else to the lowest index, so that the choice is deterministic.

    Raises:
        ValueError: an empty list, or NaN.
    """
    p = np.asarray(probability, dtype=np.float64).tolist()
    if not p or any(math.isnan(v) for v in p):
        raise ValueError(f'Expected probabilities, got {p}.')
    least = max(p) * (1 - TIE)
    return next(
        (i for i in prefer if p[i] >= least), next(i for i, v in enumerate(p) if v >= least)
    )


def reach(transition: FloatArray, goals: FloatArray | None = None) -> FloatArray:
    """P(X_f fulfils g | X_i, A), shape [..., x_i, g, a]; goals None: each state is one."""
    reached = transition if goals is None else transition @ goals.T
    return np.swapaxes(reached, -1, -2)


def direct_policy(transition: FloatArray, goals: FloatArray | None = None) -> FloatArray:
    """P(A | G = g, X_i) = P(A | X_i, X_f fulfils g), the variant the paper follows.

    A is uniform a priori: policy[x_i, g, a] = reach[x_i, g, a] / sum over a. If no action reaches
    g from x_i the row is all zero.
    """
    reached = reach(transition, goals)
    total = reached.sum(axis=-1, keepdims=True)
    policy: FloatArray = np.divide(reached, total, out=np.zeros_like(reached), where=total > 0)
    return policy


def goal_likelihood(transition: FloatArray, policy: FloatArray) -> FloatArray:
    """P(X_f | X_i, G) = sum over a of P(a | G, X_i) P(X_f | X_i, a); shape [..., x_i, x_f, g].

    Args:
        transition: of the agent: the robot's own ("like me"), or a demonstrator's.
        policy: of the same agent; all-zero rows contribute nothing.
    """
    return np.asarray(np.swapaxes(policy @ transition, -1, -2))


def normalised(joint: FloatArray, otherwise: ArrayLike) -> FloatArray:
    """Each last axis divided by its sum; `otherwise` where it sums to 0."""
    total = joint.sum(axis=-1, keepdims=True)
    fallback = np.array(np.broadcast_to(np.asarray(otherwise, dtype=np.float64), joint.shape))
    return np.asarray(np.divide(joint, total, out=fallback, where=total > 0))


def posterior_table(transition: FloatArray, policy: FloatArray, prior: ArrayLike) -> FloatArray:
    """P(G | x_i, x_f) of every change, shape [..., x_i, x_f, g]; see goal_posterior."""
    prior = np.asarray(prior, dtype=np.float64)
    return normalised(prior * goal_likelihood(transition, policy), prior)


def goal_posterior(
    transition: FloatArray, policy: FloatArray, x_i: int, x_f: int, prior: ArrayLike
) -> FloatArray:
    """P(G | x_i, x_f), proportional to P(G) P(x_f | x_i, G), actions summed out (Fig 3d).

    A change that no goal explains (probability 0 for every goal) leaves the prior. GoalModel has
    the posteriors precomputed, and accepts batches and uncertain states.

    prior[g] sums to 1; the result has the same shape.
    """
    prior = np.asarray(prior, dtype=np.float64)
    joint = prior * (policy[x_i] @ transition[x_i, :, x_f])
    total = joint.sum()
    return np.asarray(joint / total if total > 0 else prior.copy())


def map_goal(posterior: ArrayLike, x_f: int, goals: FloatArray | None = None) -> int:
    """Mode of the goal posterior; ties go to a goal that the demonstration fulfilled.

    goals: shape [g, x_f]; None: each state is a goal.
    """
    fulfilled = (x_f,) if goals is None else tuple(np.flatnonzero(goals[:, x_f]).tolist())
    return map_index(posterior, prefer=fulfilled)
