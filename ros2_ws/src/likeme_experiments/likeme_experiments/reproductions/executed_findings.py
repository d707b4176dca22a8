"""Executed imitations counted, and held against what the model expected of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from likeme_core.tabletop import Manner
from likeme_experiments.evaluation.episode import Episode
from likeme_experiments.evaluation.executed import (
    Checked,
    Difference,
    Reliability,
    Score,
    checked,
    difference,
    grouped,
    later_actions,
    reliability,
    score,
)
from likeme_experiments.evaluation.forecast import Estimate, Way, forecasts
from likeme_inference.tabletop.robot_model import RobotModel

#: Seed of the worlds drawn from the posterior.
WORLDS_SEED = 0


class Findings(NamedTuple):
    """Everything counted for one estimate.

    Attributes:
        rows: (manner, object) -> way -> score over four changes.
        averages: way -> score over all.
        cells: each case in each way against the model's interval.
        actions: each first action, predicted and achieved.
        later: predicted and achieved success of second and third actions, and how many.
        gains: name -> difference of two ways.
    """

    rows: dict[tuple[Manner, str], dict[Way, Score]]
    averages: dict[Way, Score]
    cells: list[Checked]
    actions: list[Reliability]
    later: tuple[float, float, int]
    gains: dict[str, Difference]

    @property
    def judged(self) -> list[Checked]:
        """Cells in which the robot itself had to do it: a person who is asked does not fail."""
        return [cell for cell in self.cells if not cell.asks]

    @property
    def inside(self) -> float:
        """Share of them whose executed success lies in the model's 95 % interval."""
        return float(np.mean([cell.inside for cell in self.judged]))


def findings(model: RobotModel, made: list[Episode], estimate: str, by: Estimate) -> Findings:
    """Count the episodes of one estimate and hold them against the model's forecasts.

    estimate: its name in the episodes. by: the estimate.
    """
    rng = np.random.default_rng(WORLDS_SEED)
    expected = forecasts(model, list(grouped(made, lambda e: e.case)), rng, by)

    def predicted(name: str, x_i: int, action: int, x_f: int) -> float:
        return float(by.known(model, name).transition[x_i, action, x_f])

    def scores(group: tuple[Episode, ...]) -> dict[Way, Score]:
        return {way: score(group, estimate, way, expected) for way in Way}

    return Findings(
        {
            key: scores(group)
            for key, group in grouped(made, lambda e: (e.case.manner, e.case.object)).items()
        },
        scores(tuple(made)),
        checked(made, estimate, expected),
        reliability(made, estimate, predicted),
        later_actions(made, estimate, predicted),
        _gains(lambda more, less: difference(made, estimate, more, less)),
    )


def _gains(compare: Callable[[Way, Way], Difference]) -> dict[str, Difference]:
    return {
        'goal_based_over_trajectory': compare(Way.GOAL_BASED, Way.TRAJECTORY),
        'interactive_over_goal_based': compare(Way.INTERACTIVE, Way.GOAL_BASED),
        'sequential_over_goal_based': compare(Way.SEQUENTIAL, Way.GOAL_BASED),
        'sequential_with_help_over_interactive': compare(
            Way.SEQUENTIAL_WITH_HELP, Way.INTERACTIVE
        ),
    }
