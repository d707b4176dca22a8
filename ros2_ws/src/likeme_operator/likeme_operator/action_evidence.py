"""What the robot's experience says of each action: trials, successes, credible interval."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_inference.decision_record import Inputs
from likeme_inference.tabletop.dirichlet import credible_interval
from likeme_inference.tabletop.values import Decision

#: Probability of the intervals.
LEVEL = 0.95


class ActionEvidence(NamedTuple):
    """One action from the state the object is in, towards the goal.

    Attributes:
        success: p(X_f = goal | x_i, A).
        trials: number of tries from this state; successes: of them that ended at the goal.
        low, high: equal-tailed 95 % credible bounds of `success`.
    """

    action: str
    success: float
    trials: int
    successes: int
    low: float
    high: float


def evidence(decision: Decision, inputs: Inputs) -> list[ActionEvidence]:
    """The evidence behind a decision, in the order of the actions.

    The interval is that of the settings' prior; without one, that of dirichlet.CONCENTRATION,
    as the posterior of a row would be certain after one trial.
    """
    settings, model = inputs.settings, inputs.model
    world, name = settings.world, decision.object
    if name not in model.objects and not settings.has_prior:
        # No trials of the object: every p between 0 and 1 is as good as another.
        return [ActionEvidence(a.name, 0.0, 0, 0, 0.0, 1.0) for a in world.actions]
    known = model.counted(name, settings.concentration, settings.prior)
    bounds = credible_interval(known, LEVEL)
    x_i, goal = decision.x_i, decision.goal
    counts = np.asarray(known.counts)[x_i]
    return [
        ActionEvidence(
            action.name,
            decision.success_probability[action],
            int(counts[action].sum()),
            int(counts[action, goal]),
            float(bounds.low[x_i, action, goal]),
            float(bounds.high[x_i, action, goal]),
        )
        for action in world.actions
    ]
