"""Goal-based exploration: learning P(A | G, X_i) by practice (Methods, Goal inference).

The robot picks a goal g, infers P(A | x_i, X_f = g), samples an action from it, acts, and if the
goal was reached raises P(a | g, x_i) "by a small amount" and lowers the others. Here the small
amount is `step`: pi <- pi + step (e_a - pi), which keeps pi a distribution.

The expected change is step (sum over a of q_a s_a) (pi* - pi) with q the sampling distribution and
s the real success rates, so that pi converges to pi*_a = q_a s_a / sum, geometrically in the mean,
with a variance of order `step`. `explored_policy` is that limit.
"""

from __future__ import annotations

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.checks import number
from likeme_inference.tabletop.goal_inference import direct_policy, normalised, reach


def reinforced(policy: FloatArray, x_i: int, g: int, a: int, step: float) -> FloatArray:
    """The policy after action a reached goal g from x_i: pi + step (e_a - pi) in that row.

    An all-zero row (no action reached g before) is replaced by e_a.

    Args:
        policy: shape [x_i, g, a]; not changed.
        x_i: initial state.
        g: the reached goal.
        a: the action that reached it.
        step: learning rate from 0 to 1.

    Raises:
        ValueError: a step outside 0 to 1, or an unknown state, goal or action.
    """
    _check_step(step)
    states, goals, actions = policy.shape
    policy = policy.copy()
    row = policy[number('x_i', x_i, states), number('g', g, goals)]
    a = number('a', a, actions)
    weight = step if row.any() else 1.0
    row *= 1 - weight
    row[a] += weight
    return policy


def explored_policy(
    model: FloatArray, world: FloatArray | None = None, goals: FloatArray | None = None
) -> FloatArray:
    """The policy that goal-based exploration converges to, shape [x_i, g, a].

    Args:
        model: the robot's transition[x_i, a, x_f], whose direct policy it samples from.
        world: the true transition, same shape; None: the model.
        goals: shape [g, x_f]; None: each state is a goal.

    If no action reaches a goal the row is all zero, as in the direct policy.
    """
    world = model if world is None else world
    return normalised(direct_policy(model, goals) * reach(world, goals), 0.0)


def explore(
    model: FloatArray,
    world: FloatArray,
    step: float,
    trials: int,
    rng: np.random.Generator,
    goals: FloatArray | None = None,
) -> FloatArray:
    """Simulate exploration: `trials` rounds of one action for every (x_i, g).

    Args:
        model: as in `explored_policy`.
        world: the true transition.
        step: see `reinforced`.
        trials: number of rounds.
        rng: samples actions and their outcomes.
        goals: as in `explored_policy`.

    Returns:
        The policy before and after every round, shape [trials + 1, x_i, g, a].

    Raises:
        ValueError: a step outside 0 to 1.
    """
    _check_step(step)
    direct, success = direct_policy(model, goals), reach(world, goals)
    policies = np.empty((trials + 1, *direct.shape))
    policies[0] = direct
    known = direct.any(axis=-1, keepdims=True)
    cumulative = direct.cumsum(axis=-1)
    for k in range(trials):
        drawn = rng.random(known.shape) * cumulative[..., -1:]
        a = (drawn >= cumulative).sum(axis=-1, keepdims=True).clip(max=direct.shape[-1] - 1)
        chance = np.take_along_axis(success, a, axis=-1)
        reached = (rng.random(chance.shape) < chance) & known
        chosen = (np.arange(direct.shape[-1]) == a).astype(np.float64)
        policies[k + 1] = policies[k] + step * reached * (chosen - policies[k])
    return policies


def _check_step(step: float) -> None:
    if not 0 <= step <= 1:
        raise ValueError(f'Expected a step from 0 to 1, got {step:g}.')
