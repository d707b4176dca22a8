"""Finite-horizon planning with an observation after every action (paper: future work).

Value iteration. With k actions left and an object observed in x, the value of a goal is

    V_0(x) = 1 if x fulfils the goal, else 0
    V_k(x) = 1 if x fulfils it, else max over a of sum over x' of p(x' | x, a) V_{k-1}(x'),

V_k(x) = V_0(x) where x is out of reach: an object off the table stays there. The value is the
probability to reach the goal within k actions under the optimal policy.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.arrays import BoolArray, FloatArray, IntArray
from likeme_inference.tabletop.checks import number, sums_to_one
from likeme_inference.tabletop.goal_inference import TIE

#: `Plan.action` at the goal, out of reach, and where no action can reach the goal.
NO_ACTION = -1


class Plan(NamedTuple):
    """Optimal values and actions for one goal; leading axes are models.

    Attributes:
        value: P(goal reached with k actions left), shape [..., k, x], k from 0 to the budget.
        quality: the same after taking action a first, shape [..., k, x, a]; 0 for k = 0.
        action: the best action, shape [..., k, x]; NO_ACTION where none is needed or possible.
    """

    value: FloatArray
    quality: FloatArray
    action: IntArray


def plan(
    transition: FloatArray,
    goal: BoolArray,
    actions_left: int,
    stuck: BoolArray | None = None,
    prefer: tuple[int, ...] = (),
    possible: BoolArray | None = None,
) -> Plan:
    """Find the optimal action for every state and number of actions left.

    Args:
        transition: shape [..., x_i, a, x_f]; leading axes are objects, or models of one.
        goal: which states fulfil the goal, shape [x].
        actions_left: the budget, 0 or more.
        stuck: states from which the robot cannot act, shape [x]; None: none.
        prefer: ties go to the first of these actions, else to the lowest number.
        possible: which actions can be taken at present, shape [x, a]; None: all of them.

    Raises:
        ValueError: a negative budget, wrong shapes, or rows that do not sum to 1.
    """
    *models, states, actions, _ = transition.shape
    if actions_left < 0:
        raise ValueError(f'Expected a budget of 0 actions or more, got {actions_left}.')
    goal = np.asarray(goal, dtype=bool)
    stuck = np.zeros(states, dtype=bool) if stuck is None else np.asarray(stuck, dtype=bool)
    if goal.shape != (states,) or stuck.shape != (states,):
        raise ValueError(
            f'Expected goal and stuck of shape {(states,)}, got {goal.shape}, {stuck.shape}.'
        )
    sums_to_one('transition', transition)
    resting = goal | stuck
    reached = goal.astype(np.float64)
    found = qualities(transition, reached[None], resting[None], actions_left, possible)
    nothing = np.zeros((*models, states, actions))
    quality = np.stack([nothing, *(each[..., 0, :, :] for each in found)], axis=-3)
    quality[..., 1:, resting, :] = reached[resting, None]
    best = quality.max(axis=-1)
    action = best_actions(quality, rank(actions, prefer))
    return Plan(np.where(resting, reached, best), quality, np.where(resting, NO_ACTION, action))


def qualities(
    transition: FloatArray,
    goals: FloatArray,
    resting: BoolArray,
    budget: int,
    possible: BoolArray | None = None,
) -> list[FloatArray]:
    """Q_k(g, x, a) of all goals at once: P(g reached) with k actions left, the first being a.

    Args:
        transition: shape [..., x_i, a, x_f].
        goals: which states fulfil which goal, shape [g, x].
        resting: where a goal is reached or the object is out of reach, shape [g, x].
        budget: the greatest k.
        possible: see `plan`; the quality of other actions is 0.

    Returns:
        For k from 1 to the budget, each of shape [..., g, x, a]; not meaningful at rest.
    """
    *models, states, actions, _ = transition.shape
    flat = transition.reshape(*models, states * actions, states)
    value = np.broadcast_to(goals, (*models, *goals.shape))
    found: list[FloatArray] = []
    for _ in range(budget):
        quality = (flat @ np.swapaxes(value, -1, -2)).reshape(*models, states, actions, -1)
        if possible is not None:
            quality = np.where(possible[..., None], quality, 0.0)
        found.append(np.moveaxis(quality, -1, -3))
        value = np.where(resting, goals, found[-1].max(axis=-1))
    return found


def spread(transition: FloatArray, best: Plan, x_i: int, actions: int) -> FloatArray:
    """P(X after n actions) under a plan, exact; shape [..., actions + 1, x].

    Args:
        transition: of the world, shape [..., x_i, a, x_f]; may differ from the planned-on model.
            Leading axes are worlds.
        best: a plan of at least `actions` actions: one for all worlds, or one for each.
        x_i: initial state.
        actions: number of actions.
    """
    *worlds, states, _, _ = transition.shape
    if actions >= best.value.shape[-2]:
        raise ValueError(f'Expected at most {best.value.shape[-2] - 1} actions, got {actions}.')
    where = np.zeros((*worlds, actions + 1, states))
    where[..., 0, number('x_i', x_i, states)] = 1.0
    for n in range(actions):
        chosen = np.broadcast_to(best.action[..., actions - n, :], (*worlds, states))
        index = chosen.clip(min=0)[..., None, None]
        moved = np.where(
            (chosen == NO_ACTION)[..., None],
            np.eye(states),
            np.take_along_axis(transition, index, axis=-2)[..., 0, :],
        )
        where[..., n + 1, :] = (where[..., n, None, :] @ moved)[..., 0, :]
    return where


def best_actions(quality: FloatArray, order: IntArray) -> IntArray:
    """The best action along the last axis; NO_ACTION where all qualities are 0.

    order: rank of each action among ties, broadcasts to the quality.
    """
    best = quality.max(axis=-1, keepdims=True)
    ties = quality >= best * (1 - TIE)
    first = np.where(ties, order, quality.shape[-1]).argmin(axis=-1)
    return np.where(best[..., 0] > 0, first, NO_ACTION)


def rank(actions: int, prefer: tuple[int, ...]) -> IntArray:
    """Rank of each action in deciding ties, shape [a].

    Raises:
        ValueError: an unknown or repeated action in `prefer`.
    """
    if len(set(prefer)) < len(prefer) or not set(prefer) <= set(range(actions)):
        raise ValueError(f'Expected some of {actions} actions, each once, got {prefer}.')
    order = [*prefer, *(a for a in range(actions) if a not in prefer)]
    position = np.empty(actions, dtype=np.int64)
    position[order] = np.arange(actions)
    return position
