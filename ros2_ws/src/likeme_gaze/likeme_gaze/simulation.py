"""The paper's simulated agent and mentor, and the experience an agent gathers of itself.

A frame belongs to each person: origin at the head, x where it looks by default. Lengths in cm,
angles in rad. A state x_i is the heading of the gaze; an action is (turn, distance), the turn from
x_i and how far away the eyes converge; a final state x_f is (heading, distance).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from likeme_gaze.beliefs import Gaussian
from likeme_gaze.checks import FloatArray, numbers
from likeme_gaze.frames import Pose2

DEGREE = math.pi / 180


class SimulationSetup(NamedTuple):
    """The scene (Gaze Following: Model Simulations), open details as in the authors' code.

    Attributes:
        agent, mentor: their frames; they face each other.
        goal_x, goal_y: goals are uniform in this rectangle of the agent's frame.
        start_std: initial headings are N(0, start_std²).
        angle_std: noise of a turn, and again of the heading it leads to.
        distance_std: noise of an action's distance; the final state has the action's distance.
        blindfold_angle_std: headings under an opaque blindfold are N(0, this²).
        blindfold_spread: distances under it are normal, with the mean of those with open eyes
            and this many of their standard deviations.
    """

    agent: Pose2 = Pose2(0.0, 0.0, 0.0)
    mentor: Pose2 = Pose2(600.0, 0.0, math.pi)
    goal_x: tuple[float, float] = (100.0, 500.0)
    goal_y: tuple[float, float] = (-500.0, 500.0)
    start_std: float = 30 * DEGREE
    angle_std: float = 3 * DEGREE
    distance_std: float = 10.0
    blindfold_angle_std: float = 40 * DEGREE
    blindfold_spread: float = 1.25


#: Variances of the goal's prior along the line between the two persons and across it, cm².
PRIOR_VARIANCES = (80_000.0, 20_000.0)


def goal_prior(agent: Pose2, mentor: Pose2) -> Gaussian:
    """The wide prior of the goal, halfway between agent and mentor, in the parent's frame."""
    half = Pose2((agent.x + mentor.x) / 2, (agent.y + mentor.y) / 2, 0.0)
    along = half.facing(mentor.x, mentor.y)
    return along.belief_to_parent(Gaussian(np.zeros(2), np.diag(PRIOR_VARIANCES)))


class Experience(NamedTuple):
    """n remembered head movements.

    Attributes:
        goal: where it wanted to look (n, 2), in its own frame.
        start: x_i (n,).
        action: (turn, distance) (n, 2).
        final: x_f (n, 2).
    """

    goal: FloatArray
    start: FloatArray
    action: FloatArray
    final: FloatArray


def experience_of(
    goal: ArrayLike, start: ArrayLike, action: ArrayLike, final: ArrayLike
) -> Experience:
    """The same as a value, looked at once.

    Raises:
        ValueError: shapes that do not fit together, or numbers that are not finite.
    """
    places = numbers('goal', goal, (None, 2))
    count = len(places)
    return Experience(
        places,
        numbers('start', start, (count,)),
        numbers('action', action, (count, 2)),
        numbers('final', final, (count, 2)),
    )


def aim(goal: FloatArray, start: FloatArray) -> FloatArray:
    """The action without noise that fixates `goal` (..., 2) from the heading `start` (...)."""
    x, y = goal[..., 0], goal[..., 1]
    return np.stack([np.arctan2(y, x) - start, np.hypot(x, y)], axis=-1)


def execute(
    rng: np.random.Generator, action: FloatArray, start: FloatArray, setting: SimulationSetup
) -> tuple[FloatArray, FloatArray]:
    """One noisy execution: the action as it was done, and the final state it led to (..., 2)."""
    spread = (setting.angle_std, setting.distance_std)
    done = action + rng.normal(0.0, spread, action.shape)
    heading = start + done[..., 0] + rng.normal(0.0, setting.angle_std, start.shape)
    return done, np.stack([heading, done[..., 1]], axis=-1)


def self_experience(
    rng: np.random.Generator, count: int, setting: SimulationSetup | None = None
) -> Experience:
    """Goals looked at with open eyes: what policy and transition are learned from."""
    scene = setting or SimulationSetup()
    goal, start = _goals_and_starts(rng, count, scene)
    return Experience(goal, start, *execute(rng, aim(goal, start), start, scene))


def blindfolded_experience(
    rng: np.random.Generator, count: int, setting: SimulationSetup | None = None
) -> Experience:
    """Head movements under an opaque blindfold: they have nothing to do with any goal."""
    scene = setting or SimulationSetup()
    goal, start = _goals_and_starts(rng, count, scene)
    seen = np.hypot(*_goals_and_starts(rng, 10 * count, scene)[0].T)
    turn = rng.normal(0.0, scene.blindfold_angle_std, count)
    distance = rng.normal(seen.mean(), scene.blindfold_spread * seen.std(), count)
    action = np.stack([turn, distance], axis=-1)
    return Experience(goal, start, *execute(rng, action, start, scene))


def _goals_and_starts(
    rng: np.random.Generator, count: int, setting: SimulationSetup
) -> tuple[FloatArray, FloatArray]:
    low, high = zip(setting.goal_x, setting.goal_y, strict=True)
    return rng.uniform(low, high, (count, 2)), rng.normal(0.0, setting.start_std, count)
