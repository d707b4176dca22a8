"""Errors of forward inference, reverse inference and gaze following (Fig 5)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_gaze.beliefs import Gaussian, independent, known, mahalanobis
from likeme_gaze.chain import HeadModel
from likeme_gaze.checks import FloatArray
from likeme_gaze.following import Following, Viewpoints, follow_gaze, forward_inference
from likeme_gaze.frames import wrapped
from likeme_gaze.gaze_model import GazeModel
from likeme_gaze.reverse import Evidence
from likeme_gaze.simulation import DEGREE, SimulationSetup, aim, execute, goal_prior

#: The test region in the agent's frame, cm, and its 375 points.
REGION_X, REGION_Y = (200.0, 400.0, 15), (-400.0, 400.0, 25)
OBSERVATIONS = 5
#: 95 % of a Gaussian in the plane lies within this squared Mahalanobis distance: -2 log 0.05.
INSIDE_95 = float(-2 * np.log(0.05))


class GazeTest(NamedTuple):
    """Test data of one agent: N goals, K observations of each.

    Attributes:
        goal: in the agent's frame, cm (N, 2).
        agent_start: the agent's heading (N,).
        mentor_start: the mentor's, in its own frame (N,).
        final: results of the mentor's K executions (K, N, 2).
    """

    goal: FloatArray
    agent_start: FloatArray
    mentor_start: FloatArray
    final: FloatArray


class GazeErrors(NamedTuple):
    """Signed errors, degrees, of the direction as seen from the agent.

    Attributes:
        forward: predicted final heading for a known goal (N,).
        reverse: direction of the inferred goal after each observation (K, N).
        following: predicted final heading for the inferred goal (K, N).
        covered: whether the 95 % region of the goal's posterior holds the goal (K, N).
    """

    forward: FloatArray
    reverse: FloatArray
    following: FloatArray
    covered: NDArray[np.bool_]


def test_region() -> FloatArray:
    """The test region's goals, (375, 2)."""
    x, y = np.meshgrid(np.linspace(*REGION_X), np.linspace(*REGION_Y))
    return np.stack([x.ravel(), y.ravel()], axis=-1)


def gaze_test(rng: np.random.Generator, setting: SimulationSetup | None = None) -> GazeTest:
    """Every goal of the test region, looked at five times by the mentor."""
    scene = setting or SimulationSetup()
    goal = test_region()
    agent_start, mentor_start = rng.normal(0.0, scene.start_std, (2, len(goal)))
    seen = scene.mentor.from_parent(scene.agent.to_parent(goal))
    action = np.broadcast_to(aim(seen, mentor_start), (OBSERVATIONS, *seen.shape))
    starts = np.broadcast_to(mentor_start, (OBSERVATIONS, len(goal)))
    return GazeTest(goal, agent_start, mentor_start, execute(rng, action, starts, scene)[1])


def gaze_errors(
    model: HeadModel, test: GazeTest, setting: SimulationSetup | None = None
) -> GazeErrors:
    """Run all three inferences on every goal of the test."""
    direction = np.arctan2(test.goal[:, 1], test.goal[:, 0])
    start = known(test.agent_start[:, None])
    ahead = forward_inference(model, known(test.goal), start)
    steps = list(followed(model, test, setting))
    headings = np.stack([step.final.mean[:, 0] for step in steps])
    inferred = np.stack([np.arctan2(*step.goal.mean.T[::-1]) for step in steps])
    return GazeErrors(
        wrapped(ahead.final.mean[:, 0] - direction) / DEGREE,
        wrapped(inferred - direction) / DEGREE,
        wrapped(headings - direction) / DEGREE,
        np.stack([mahalanobis(step.goal, test.goal) <= INSIDE_95 for step in steps]),
    )


def followed(
    model: HeadModel, test: GazeTest, setting: SimulationSetup | None = None
) -> Iterator[Following]:
    """Inferred goal and predicted heading after each observation, all goals at once."""
    scene = setting or SimulationSetup()
    prior = _prior(test.mentor_start, scene)
    views = Viewpoints(scene.agent, scene.mentor, known(test.agent_start[:, None]))
    around: Gaussian | None = None
    for count in range(1, len(test.final) + 1):
        evidence = Evidence(count, test.final[:count].mean(axis=0))
        step = follow_gaze((model, model), prior, evidence, views, around)
        around = step.mentor
        yield step


def gaze_accuracy(seed: int, points: int = 200) -> GazeErrors:
    """Train one agent on `points` head movements and test it; both follow from the seed."""
    rng = np.random.default_rng([seed, 1])
    return gaze_errors(GazeModel.simulated(seed, points).head, gaze_test(rng))


def _prior(start: FloatArray, setting: SimulationSetup) -> Gaussian:
    goal = setting.mentor.belief_from_parent(goal_prior(setting.agent, setting.mentor))
    wide = np.broadcast_to(goal.covariance, (len(start), 2, 2))
    return independent(
        Gaussian(np.broadcast_to(goal.mean, (len(start), 2)), wide), known(start[:, None])
    )
