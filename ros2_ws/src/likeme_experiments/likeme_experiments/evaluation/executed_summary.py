"""All scores of executed imitations of one estimate, beside the model's forecasts."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from likeme_core.tabletop import Manner
from likeme_core.world import World
from likeme_experiments.evaluation.episode import ImitationEpisode
from likeme_experiments.evaluation.executed import (
    ApproachScore,
    Difference,
    IntervalCheck,
    Reliability,
    difference,
    grouped,
    interval_checks,
    later_actions,
    reliability,
    score,
)
from likeme_experiments.evaluation.forecast import Approach, Estimate, forecasts
from likeme_inference.tabletop.robot_model import RobotModel

#: Seed of the worlds drawn from the posterior.
WORLDS_SEED = 0


class ExecutedSummary(NamedTuple):
    """The scores of one estimate.

    Attributes:
        rows: (manner, object) -> approach -> score over four changes.
        averages: approach -> score over all.
        cells: each case and approach against the model's interval.
        actions: first actions, predicted and achieved.
        later: predicted and achieved success of second and third actions, and how many.
        gains: name -> difference of two approaches.
    """

    rows: dict[tuple[Manner, str], dict[Approach, ApproachScore]]
    averages: dict[Approach, ApproachScore]
    cells: list[IntervalCheck]
    actions: list[Reliability]
    later: tuple[float, float, int]
    gains: dict[str, Difference]

    @property
    def acting(self) -> list[IntervalCheck]:
        """Cells in which the robot acts: where it asks, success is certain."""
        return [cell for cell in self.cells if not cell.asks]

    @property
    def inside(self) -> float:
        """Proportion of them whose executed success lies in the model's 95 % interval."""
        return float(np.mean([cell.inside for cell in self.acting]))


def executed_summary(
    world: World, model: RobotModel, made: list[ImitationEpisode], estimate: str, by: Estimate
) -> ExecutedSummary:
    """Score the episodes of one estimate.

    estimate: its name in the episodes. by: the estimate.
    """
    rng = np.random.default_rng(WORLDS_SEED)
    expected = forecasts(world, model, list(grouped(made, lambda e: e.case)), rng, by)

    def predicted(name: str, x_i: int, action: int, x_f: int) -> float:
        return float(by.known(model, name).transition[x_i, action, x_f])

    def scores(group: tuple[ImitationEpisode, ...]) -> dict[Approach, ApproachScore]:
        return {approach: score(group, estimate, approach, expected) for approach in Approach}

    return ExecutedSummary(
        {
            key: scores(group)
            for key, group in grouped(made, lambda e: (e.case.manner, e.case.object)).items()
        },
        scores(tuple(made)),
        interval_checks(made, estimate, expected),
        reliability(made, estimate, predicted, world),
        later_actions(made, estimate, predicted),
        _gains(lambda more, less: difference(made, estimate, more, less)),
    )


def _gains(compare: Callable[[Approach, Approach], Difference]) -> dict[str, Difference]:
    return {
        'goal_based_over_trajectory': compare(Approach.GOAL_BASED, Approach.TRAJECTORY),
        'interactive_over_goal_based': compare(Approach.INTERACTIVE, Approach.GOAL_BASED),
        'sequential_over_goal_based': compare(Approach.SEQUENTIAL, Approach.GOAL_BASED),
        'sequential_with_help_over_interactive': compare(
            Approach.SEQUENTIAL_WITH_HELP, Approach.INTERACTIVE
        ),
    }
