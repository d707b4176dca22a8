"""How well agents tell by movements alone whether a mentor can see (beyond the paper).

Half of the mentors look five times at one of Fig 6's targets with open eyes; the others wear an
opaque blindfold and turn anywhere. Fifteen movements, an infant's, are too few to know one's own
noise by: most agents take it to be at its floor, and are misled by the scatter of a mentor's
movements. These agents have learned from 50.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from likeme_gaze.beliefs import Gaussian
from likeme_gaze.blindfold import (
    EXECUTIONS,
    TRIALS,
    Blindfold,
    infant,
    shown,
    trial_prior,
)
from likeme_gaze.blindfold_detection import eyes_covered
from likeme_gaze.checks import FloatArray
from likeme_gaze.simulation import SimulationSetup, blindfolded_experience

#: Movements of each kind, with open eyes and under the blindfold, that an agent learned from.
TELLING_POINTS = 50
#: Keeps these agents apart from those of Fig 6's groups.
STREAM = 100


def agent_tells(seed: int, agent: int, points: int = TELLING_POINTS) -> FloatArray:
    """P(blindfolded) that one agent gives after each movement (EXECUTIONS, 2, TRIALS).

    Second axis: mentors with open eyes, and mentors under an opaque blindfold.
    """
    rng, scene = np.random.default_rng([seed, STREAM, agent]), SimulationSetup()
    model = infant(rng, Blindfold.OPAQUE, points=points)
    sides = rng.permutation([1.0, -1.0] * (TRIALS // 2))
    mentors = np.stack([shown(rng, sides, scene), _unseeing(rng, scene)], axis=1)
    prior = Gaussian(*(np.stack([part, part]) for part in trial_prior(scene)))
    return np.array([eyes_covered(model, prior, mentors[: k + 1]) for k in range(EXECUTIONS)])


def told_right(probabilities: FloatArray) -> NDArray[np.bool_]:
    """Whether the mentor's kind is the more probable one, from P(blindfolded) (..., 2, TRIALS)."""
    return np.asarray((probabilities > 0.5) == np.array([[False], [True]]))


def _unseeing(rng: np.random.Generator, setting: SimulationSetup) -> FloatArray:
    """Movements under an opaque blindfold, each begun facing the agent (EXECUTIONS, TRIALS, 2)."""
    memory = blindfolded_experience(rng, EXECUTIONS * TRIALS, setting)
    final = memory.final - np.stack([memory.start, np.zeros_like(memory.start)], axis=-1)
    return final.reshape(EXECUTIONS, TRIALS, 2)
