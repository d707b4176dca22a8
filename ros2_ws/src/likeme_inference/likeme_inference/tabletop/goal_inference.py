"""From a demonstrated change to the goal behind it (Fig 3b, 3c, 3d; Fig 8a).

All functions are pure and work for any number of states and actions. A goal is the state to be
reached, so goals are numbered as states. Axes are named: transition[x_i, a, x_f],
policy[x_i, g, a], prior[g].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.transition_model import FloatArray

#: Two probabilities that differ by less were reached by different roundings of the same sum.
TIE = 1e-12


def map_index(probability: ArrayLike, prefer: tuple[int, ...] = ()) -> int:
    """Index of the greatest probability (MAP).

    Ties (within 1e-12) go to the first of `prefer` that is among the greatest, else to the lowest
    index, so that the same numbers always lead to the same choice.
    """
    p = np.asarray(probability, dtype=np.float64)
    greatest = np.flatnonzero(p >= p.max() - TIE)
    return next((i for i in prefer if i in greatest), int(greatest[0]))


def direct_policy(transition: FloatArray) -> FloatArray:
    """P(A | G = g, X_i) = P(A | X_i, X_f = g), the variant the paper follows, A uniform a priori.

    policy[x_i, g, a] = transition[x_i, a, g] / sum over a. Where no action reaches g from x_i the
    row is all zero: no action serves that goal, and none is preferred.
    """
    reach = np.swapaxes(transition, -1, -2)
    total = reach.sum(axis=-1, keepdims=True)
    policy: FloatArray = np.divide(reach, total, out=np.zeros_like(reach), where=total > 0)
    return policy


def goal_likelihood(transition: FloatArray, policy: FloatArray, x_i: int, x_f: int) -> FloatArray:
    """P(X_f = x_f | X_i = x_i, G) = sum over a of P(a | G, x_i) P(x_f | x_i, a); shape [g]."""
    return np.asarray(policy[x_i] @ transition[x_i, :, x_f])


def goal_posterior(
    transition: FloatArray, policy: FloatArray, x_i: int, x_f: int, prior: ArrayLike
) -> FloatArray:
    """P(G | x_i, x_f), proportional to P(G) P(x_f | x_i, G), actions summed out (Fig 3d).

    A change that no goal can explain (the robot's own actions never did it) leaves the prior.

    prior[g] sums to 1; the result has the same shape.
    """
    prior = np.asarray(prior, dtype=np.float64)
    joint = prior * goal_likelihood(transition, policy, x_i, x_f)
    total = joint.sum()
    return joint / total if total > 0 else prior.copy()


def map_goal(posterior: ArrayLike, x_f: int) -> int:
    """Mode of the goal posterior; among equals the state the demonstration ended in."""
    return map_index(posterior, prefer=(x_f,))
