"""P(X_f fulfils the goal that was meant | x, A), with what is not known of the transitions.

The person is like the robot: one theta = p(X_f | X_i, A) says what either of them brings about,
and the person, like the robot, leaves an object that is as it is wanted. A demonstration
x_i -> x_f thus says of both the goal and theta

    P(g, theta | x_i, x_f) ~ P(g) [x_i does not fulfil g] p(theta) P(x_f | x_i, g, theta),

p(theta) the Dirichlet posterior of the robot's trials. What fulfils the goal that was meant is a
mean over both,

    sum over g, theta of P(g, theta | x_i, x_f) P(X_f fulfils g | x, a, theta),

and not the product of two means: a goal explains what was shown best where theta has the robot
reach it, too. Draws of theta stand for p(theta); a transition without a posterior
(GoalModel.estimated) is one draw.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.checks import number, sums_to_one
from likeme_inference.tabletop.dirichlet import sample_rows
from likeme_inference.tabletop.evidence import evidence, known
from likeme_inference.tabletop.goal_model import GoalModel, policy_of
from likeme_inference.tabletop.planning import spread

#: Draws of theta, the same at each call; the standard error of a success is 0.003 or less.
DRAWS = 2048


def meant(model: GoalModel, x_i: ArrayLike, x_f: ArrayLike) -> FloatArray:
    """P(G, theta | x_i, x_f) over draws of theta, shape [draw, g], sums to 1.

    A change that no goal explains leaves the prior.

    Args:
        model: of the object.
        x_i: before the demonstration: a known state, or a distribution (evidence.py).
        x_f: after it.

    Raises:
        ValueError: an unknown state, or evidence on more than one demonstration.
    """
    states = len(model.transition)
    seen = [evidence(what, x, states) for what, x in (('x_i', x_i), ('x_f', x_f))]
    here, there = (np.eye(states)[each] if known(each) else each for each in seen)
    if here.ndim != 1 or there.ndim != 1:
        raise ValueError('Expected one demonstration, got several.')
    likelihood = np.zeros((_draws(model), len(model.goals)))
    for x in np.flatnonzero(here).tolist():
        # P(x_f | x, g, theta) = sum over a of P(a | g, x) P(x_f | x, a).
        explained = np.einsum('sga,sa->sg', _policy(model, x), _demonstrator(model, x) @ there)
        likelihood += here[x] * (1 - model.goals[:, x]) * explained
    joint = model.prior * likelihood
    if joint.sum() <= 0:
        joint = np.broadcast_to(model.prior, joint.shape)
    return np.asarray(joint / joint.sum())


def intended_success(model: GoalModel, x: int, belief: ArrayLike) -> FloatArray:
    """P(X_f fulfils the goal that was meant | x, A) of every action, shape [a].

    Args:
        model: of the object.
        x: its current state.
        belief: `meant`; or P(G) of any goals, shape [g].

    Raises:
        ValueError: an unknown state; a belief of another shape, or that does not sum to 1.
    """
    x, weights = number('x', x, len(model.transition)), _weights(model, belief)
    rows = _world(model, x) if len(weights) > 1 else model.transition[None, x]
    return np.asarray(np.einsum('sg,sag->a', weights, rows @ model.goals.T))


def intended_plan_success(
    model: GoalModel, x: int, belief: ArrayLike, goal: int, actions_left: int
) -> float:
    """P(the last state fulfils the goal that was meant) of the best plan for `goal`.

    Args and errors: see `intended_success`; actions_left: 0 or more.
    """
    weights, best = _weights(model, belief), model.plan(goal, actions_left)
    worlds = model.transition[None]
    if len(weights) > 1:
        worlds = np.stack([_world(model, each) for each in range(len(model.transition))], axis=1)
    ends = spread(worlds, best, x, actions_left)[:, -1]
    return float(np.sum(weights * (ends @ model.goals.T)))


def _weights(model: GoalModel, belief: ArrayLike) -> FloatArray:
    weights = np.atleast_2d(np.asarray(belief, dtype=np.float64))
    if weights.shape not in {(1, len(model.goals)), (_draws(model), len(model.goals))}:
        raise ValueError(
            f'Expected a belief in {len(model.goals)} goals, got one of shape {weights.shape}.'
        )
    sums_to_one('belief', weights.ravel())
    return weights


def _draws(model: GoalModel) -> int:
    return 1 if model.estimated is None else DRAWS


def _demonstrator(model: GoalModel, x: int) -> FloatArray:
    """p(X_f | x, A) of the demonstrator, shape [draw, a', x_f]."""
    return model.demonstrator[None, x] if model.estimated is None else _rows(model, x)


def _policy(model: GoalModel, x: int) -> FloatArray:
    """P(A | G, x) of the demonstrator, shape [draw, g, a']."""
    if model.estimated is None:
        return model.demonstrator_policy[None, x]
    variant = model.estimated.policy
    found: FloatArray = model.answers.get(
        ('policy', x), lambda: policy_of(_rows(model, x), model.goals, variant)
    )
    return found


def _world(model: GoalModel, x: int) -> FloatArray:
    """Draws of p(X_f | x, A) of what can be done at present, shape [draw, a, x_f]."""
    rows = _rows(model, x)
    if model.possible is None:
        return rows
    return np.where(model.possible[x][:, None], rows, model.transition[x])


def _rows(model: GoalModel, x: int) -> FloatArray:
    """Draws of p(X_f | x, A), shape [draw, a, x_f]."""
    assert model.estimated is not None, 'A certain transition has no draws.'
    alpha = model.estimated.pseudo_counts[x]
    found: FloatArray = model.answers.get(
        ('rows', x), lambda: sample_rows(alpha, np.random.default_rng(x), DRAWS)
    )
    return found
