"""Agent and mentor face each other; the agent infers what the mentor looks at (Fig 4)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_experiments.evaluation.gaze_accuracy import (
    OBSERVATIONS,
    GazeTest,
    followed,
)
from likeme_gaze.beliefs import Gaussian
from likeme_gaze.checks import FloatArray
from likeme_gaze.gaze_model import GazeModel
from likeme_gaze.simulation import SimulationSetup, aim, execute

#: Goals equally far from both persons, to the left and to the right, cm.
GOAL_X, GOAL_Y = 300.0, (-400.0, -300.0, -200.0, -100.0, 100.0, 200.0, 300.0, 400.0)


class GazeScene(NamedTuple):
    """The scene of Fig 4; N goals in the agent's frame.

    Attributes:
        setting: where the two stand.
        test: goals, starts, and results of the mentor's executions.
        inferred: the goal's posterior after all observations (N, 2), (N, 2, 2).
        agent_final: the agent's predicted final heading (N,).
    """

    setting: SimulationSetup
    test: GazeTest
    inferred: Gaussian
    agent_final: FloatArray

    @property
    def distance_off(self) -> FloatArray:
        """Distance of each inferred goal from the true one, cm (N,)."""
        return np.asarray(np.linalg.norm(self.inferred.mean - self.test.goal, axis=-1))


def gaze_scene(seed: int, points: int = 200) -> GazeScene:
    """Train one agent and infer every goal from the mentor's gaze."""
    rng, scene = np.random.default_rng([seed, 2]), SimulationSetup()
    goal = np.array([(GOAL_X, y) for y in GOAL_Y])
    agent_start, mentor_start = rng.normal(0.0, scene.start_std, (2, len(goal)))
    action = aim(scene.mentor.from_parent(goal), mentor_start)
    shape = (OBSERVATIONS, *action.shape)
    starts = np.broadcast_to(mentor_start, shape[:2])
    _, final = execute(rng, np.broadcast_to(action, shape), starts, scene)
    test = GazeTest(goal, agent_start, mentor_start, final)
    *_, last = followed(GazeModel.simulated(seed, points).head, test, scene)
    return GazeScene(scene, test, last.goal, last.final.mean[:, 0])
