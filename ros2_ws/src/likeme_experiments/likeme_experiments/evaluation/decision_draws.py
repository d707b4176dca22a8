"""How sure goals and decisions are after the robot's trials: over draws of its posterior."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.posterior_sampling import PosteriorDraws
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.sensitivity import (
    NO_ACTION,
    REFERENCE,
    ShownChange,
    prior_sensitivity,
)

LEVEL = 0.95


class DecisionDraws(NamedTuple):
    """One demonstration over draws of p(X_f | X_i, A).

    Attributes:
        change: the demonstration.
        reference: P(G = x_f | x_i, x_f) by maximum likelihood.
        mean, low, high: of it over the draws, and bounds of LEVEL.
        same_goal, same_action, same_asking: share of draws at which the MAP goal is that of
            maximum likelihood; likewise the best action for the draw's goal, and whether the
            robot asks.
    """

    change: ShownChange
    reference: float
    mean: float
    low: float
    high: float
    same_goal: float
    same_action: float
    same_asking: float


def decision_draws(
    model: RobotModel, draws: PosteriorDraws, threshold: float = 0.5
) -> list[DecisionDraws]:
    """Every demonstration of a change, in the interactive mode."""
    paper = prior_sensitivity(
        model, [REFERENCE], threshold, goal_prior=draws.goal_prior.tolist(), policy=draws.policy
    )
    rows = []
    for c, change in enumerate(paper.changes):
        o = draws.objects.index(change.object)
        posterior = draws.posterior.goal_probability[:, :, o, change.x_i, change.x_f]
        goal, action, asks = _decided(draws, o, change.x_i, posterior, threshold)
        shown = posterior[..., change.x_f]
        tail = (1 - LEVEL) / 2
        low, high = np.quantile(shown, [tail, 1 - tail]).tolist()
        rows.append(
            DecisionDraws(
                change,
                float(paper.posterior[0, c, change.x_f]),
                float(shown.mean()),
                low,
                high,
                float((goal == paper.goal[0, c]).mean()),
                float((action == paper.action[0, c]).mean()),
                float((asks == paper.asks[0, c]).mean()),
            )
        )
    return rows


def _decided(
    draws: PosteriorDraws, o: int, x_i: int, posterior: FloatArray, threshold: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Goal, action and asking of each draw, shape [chain, draw]."""
    goal = posterior.argmax(axis=-1)
    reached = draws.posterior.transition[:, :, o, x_i] @ draws.goal_states.T
    success = np.take_along_axis(reached, goal[..., None, None], axis=-1)[..., 0]
    there = draws.goal_states[goal, x_i] > 0
    action = np.where(there, NO_ACTION, success.argmax(axis=-1))
    return goal, action, ~there & (success.max(axis=-1) < threshold)
