"""Whether an agent follows the gaze of a mentor who wears a blindfold (Fig 1b, Fig 6).

Agents with little experience (n = 15) watch a mentor turn 45 degrees to a target that is as far
from either of them. An agent that knows blindfolds explains the mentor by the policy π_B it
learned under one; its own head is never covered.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

import numpy as np

from likeme_gaze.beliefs import Gaussian, independent, known
from likeme_gaze.checks import FloatArray
from likeme_gaze.following import Viewpoints, follow_gaze
from likeme_gaze.gaze_model import GazeModel
from likeme_gaze.reverse import Evidence
from likeme_gaze.simulation import (
    DEGREE,
    Experience,
    SimulationSetup,
    aim,
    blindfolded_experience,
    execute,
    goal_prior,
    self_experience,
)
from likeme_gaze.training import Search

#: Training points of an infant, trials it is shown, and executions of the mentor's turn in each.
POINTS, TRIALS, EXECUTIONS = 15, 4, 5
#: The mentor's turn, rad, and what counts as following: the paper's threshold and a stricter one.
TURN, THRESHOLDS = 45 * DEGREE, (30 * DEGREE, 35 * DEGREE)
#: Fifteen points carry few details: one start of the optimiser, and no signal below its noise.
INFANT_SEARCH = Search(starts=((3.0, 1.5, 0.2),), iterations=60)


class Blindfold(Enum):
    """What an agent has experienced under the blindfold the mentor wears."""

    UNKNOWN = 'never worn'
    WINDOWED = 'with windows'
    OPAQUE = 'opaque'
    SEE_THROUGH = 'see-through'


class Group(NamedTuple):
    """Agents of one kind in front of one kind of mentor.

    Attributes:
        name: as in the table.
        experience: with the blindfold.
        covers: whether what the mentor wears covers its eyes; a headband does not.
        follows: what infants of this group do.
    """

    name: str
    experience: Blindfold
    covers: bool
    follows: bool


#: Fig 6: 12-month-olds after one of three kinds of self-experience.
FIGURE_GROUPS = (
    Group('baseline', Blindfold.UNKNOWN, True, True),
    Group('windowed', Blindfold.WINDOWED, True, True),
    Group('opaque', Blindfold.OPAQUE, True, False),
)
#: What the paper tells and does not model: older infants know what closed eyes do, so they do not
#: follow a blindfold, follow a headband, and follow again after a blindfold one can see through.
OLDER_GROUPS = (
    Group('18 months, blindfold', Blindfold.OPAQUE, True, False),
    Group('18 months, headband', Blindfold.OPAQUE, False, True),
    Group('18 months, see-through', Blindfold.SEE_THROUGH, True, True),
)


def infant(
    rng: np.random.Generator,
    experience: Blindfold,
    setting: SimulationSetup | None = None,
    points: int = POINTS,
) -> GazeModel:
    """An agent with `points` head movements, and as many under the blindfold where it wore one.

    Through windows, and through a see-through blindfold, targets are seen: that experience is like
    any other. The windows group is trained normally, as in the paper: it learns no policy of its
    own for the blindfold. After a see-through one the agent knows that blindfold by itself.
    """
    scene = setting or SimulationSetup()
    memory = self_experience(rng, points, scene)
    hooded: Experience | None = None
    if experience is Blindfold.OPAQUE:
        hooded = blindfolded_experience(rng, points, scene)
    elif experience is Blindfold.SEE_THROUGH:
        hooded = self_experience(rng, points, scene)
    return GazeModel.learned(memory, hooded, INFANT_SEARCH)


def turns(
    rng: np.random.Generator,
    agent: GazeModel,
    covers: bool,
    setting: SimulationSetup | None = None,
) -> FloatArray:
    """How far the agent turns towards the target in each of 4 trials, rad (TRIALS,).

    Positive is the right direction. Two targets to either side, in random order; the agent starts
    looking at the mentor, and its turn is a noisy execution of the action it inferred.
    """
    scene = setting or SimulationSetup()
    sides = rng.permutation([1.0, -1.0] * (TRIALS // 2))
    start = np.zeros(TRIALS)
    following = follow_gaze(
        (agent.mentor_head(covers), agent.head),
        trial_prior(scene),
        Evidence(EXECUTIONS, shown(rng, sides, scene).mean(axis=0)),
        Viewpoints(scene.agent, scene.mentor, known(start[:, None])),
    )
    _, final = execute(rng, following.action.mean, start, scene)
    # The mentor faces the agent: its left is the agent's right.
    return -sides * final[:, 0]


def scores(turned: FloatArray, threshold: float) -> FloatArray:
    """Sum over trials of +1 for a turn of `threshold` the right way and -1 the wrong way (...)."""
    right, wrong = turned >= threshold, turned <= -threshold
    return np.asarray(right.sum(axis=-1) - wrong.sum(axis=-1), dtype=np.float64)


def shown(rng: np.random.Generator, sides: FloatArray, setting: SimulationSetup) -> FloatArray:
    """The mentor's executions of a turn to each side, from facing the agent (K, TRIALS, 2)."""
    away = math.hypot(setting.mentor.x - setting.agent.x, setting.mentor.y - setting.agent.y)
    distance = away / 2 / math.cos(TURN)
    goal = distance * np.stack([np.cos(TURN * sides), np.sin(TURN * sides)], axis=-1)
    start = np.zeros((EXECUTIONS, TRIALS))
    action = np.broadcast_to(aim(goal, np.zeros(TRIALS)), (EXECUTIONS, TRIALS, 2))
    return execute(rng, action, start, setting)[1]


def trial_prior(setting: SimulationSetup) -> Gaussian:
    """Prior of (goal, x_i) in the mentor's frame, the same for every trial."""
    goal = setting.mentor.belief_from_parent(goal_prior(setting.agent, setting.mentor))
    both = independent(goal, known([0.0]))
    shape = (TRIALS, *both.mean.shape)
    return Gaussian(
        np.broadcast_to(both.mean, shape), np.broadcast_to(both.covariance, (*shape, shape[-1]))
    )
