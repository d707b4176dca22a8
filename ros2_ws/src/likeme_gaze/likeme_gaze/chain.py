"""Goal and start to action to final state, as one linear-Gaussian chain around a belief (Fig 1a).

The two Gaussian processes are the policy, a = π(g, x_i) + u, and the transition,
x_f = f(x_i, a) + n. A Gaussian belief about (g, x_i) is carried through the first, and the joint
Gaussian of (a, x_i) through the second, with exact moments. The action depends on the start, so
their covariance is carried along.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_gaze.beliefs import Gaussian, coupled, symmetric
from likeme_gaze.checks import FloatArray
from likeme_gaze.gaussian_processes import GaussianProcesses

#: A goal is a place in the plane.
GOAL = 2


class HeadModel(NamedTuple):
    """What an agent knows of its own head: policy π and transition f.

    Attributes:
        policy: inputs (goal x, goal y, x_i ...), outputs the action.
        transition: inputs (action ..., x_i ...), outputs x_f.
    """

    policy: GaussianProcesses
    transition: GaussianProcesses

    @property
    def action_width(self) -> int:
        """Coordinates of an action."""
        return int(self.policy.targets.shape[1])


class Chain(NamedTuple):
    """The chain linearised around a belief z = (g, x_i); batches add leading axes.

    Attributes:
        start: the belief z (..., Z).
        action: a (..., A).
        moved: the joint (a, x_i) (..., A + Z - 2).
        final: x_f (..., F).
        by_goal: gain of z on a: E[a | z] = E[a] + by_goal'(z - E[z]) (..., Z, A).
        by_action: gain of (a, x_i) on x_f (..., A + Z - 2, F).
        cross: Cov[z, (a, x_i)] (..., Z, A + Z - 2).
    """

    start: Gaussian
    action: Gaussian
    moved: Gaussian
    final: Gaussian
    by_goal: FloatArray
    by_action: FloatArray
    cross: FloatArray

    @property
    def sensitivity(self) -> FloatArray:
        """Gain of z on x_f through action and start (..., Z, F)."""
        width = self.action.mean.shape[-1]
        through = self.by_goal @ self.by_action[..., :width, :]
        through[..., GOAL:, :] += self.by_action[..., width:, :]
        return through


def chain(model: HeadModel, belief: Gaussian, keep_coupling: bool = True) -> Chain:
    """Carry the belief about (g, x_i) through policy and transition.

    Without `keep_coupling` action and start enter the transition as if independent, as the
    authors' code has it.
    """
    policy = model.policy.regress(*belief)
    action = Gaussian(policy.mean, policy.covariance)
    with_action = policy.cross
    with_start = belief.covariance[..., GOAL:]
    between = np.swapaxes(with_action[..., GOAL:, :], -1, -2)
    if not keep_coupling:
        between, with_start = np.zeros_like(between), np.zeros_like(with_start)
    moved = coupled(action, belief.part(GOAL, belief.mean.shape[-1]), between)
    transition = model.transition.regress(*moved)
    return Chain(
        belief,
        action,
        moved,
        Gaussian(transition.mean, transition.covariance),
        policy.gain,
        transition.gain,
        np.concatenate([with_action, with_start], axis=-1),
    )


def execution_noise(model: HeadModel, linear: Chain) -> FloatArray:
    """Covariance of x_f between executions of one goal from one start (..., F, F).

    Noise of the action, carried through the transition, and noise of the final state. All other
    doubt (the goal, the start, what the Gaussian processes do not know) executions have in common.
    """
    width = model.action_width
    through = linear.by_action[..., :width, :]
    carried = np.swapaxes(through, -1, -2) @ (model.policy.noise_variance[:, None] * through)
    return symmetric(carried + np.diag(model.transition.noise_variance))
