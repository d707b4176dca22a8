"""Goal-based exploration: convergence of the policy with practice (Methods)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_core.world import World
from likeme_experiments.evaluation.demonstrations import changes_of
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.goal_exploration import explore, explored_policy
from likeme_inference.tabletop.robot_model import RobotModel

STEPS = (0.01, 0.05, 0.2)


class Convergence(NamedTuple):
    """Distance of a practised policy from its limit.

    Attributes:
        steps: of `reinforced`, shape [step].
        distance: total variation between P(A | g, x_i) and the limit, averaged over objects,
            changes and seeds; shape [step, round].
        of_mean: the same of the policy averaged over seeds, its bias, which vanishes
            geometrically; shape [step, round].
    """

    steps: tuple[float, ...]
    distance: FloatArray
    of_mean: FloatArray


def practice(
    model: RobotModel,
    world: World,
    rounds: int = 1000,
    seeds: int = 20,
    steps: tuple[float, ...] = STEPS,
) -> Convergence:
    """Practise every goal from every state; one action of each pair a round."""
    distance, of_mean = [], []
    x_i, g = (list(axis) for axis in zip(*changes_of(world), strict=True))
    for step in steps:
        gaps, mean_gaps = [], []
        for learned in model.objects.values():
            own = learned.transition
            limit = explored_policy(own)[x_i, g]
            runs = np.array(
                [
                    explore(own, own, step, rounds, np.random.default_rng(seed))[:, x_i, g]
                    for seed in range(seeds)
                ]
            )
            gaps.append(_gap(runs, limit).mean(axis=(0, 2)))
            mean_gaps.append(_gap(runs.mean(axis=0), limit).mean(axis=-1))
        distance.append(np.mean(gaps, axis=0))
        of_mean.append(np.mean(mean_gaps, axis=0))
    return Convergence(steps, np.array(distance), np.array(of_mean))


def _gap(policy: FloatArray, limit: FloatArray) -> FloatArray:
    """Total variation distance along the last axis."""
    return np.asarray(np.abs(policy - limit).sum(axis=-1) / 2)
