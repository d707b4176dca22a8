"""Accuracy of detecting a blindfold from the mentor's movements alone (beyond the paper).

Half of the mentors look five times at one of Fig 6's targets with open eyes; the others wear an
opaque blindfold and turn in random directions. An agent with 15 movements, as in Fig 6, cannot
estimate its own motion noise: most fits end at the noise floor and misread the scatter of a
mentor's movements. These agents have learned from 50.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from likeme_gaze.beliefs import Gaussian
from likeme_gaze.blindfold import (
    EXECUTIONS,
    TRIALS,
    WornBlindfold,
    infant,
    mentor_turns,
    trial_prior,
)
from likeme_gaze.blindfold_detection import blindfold_probability
from likeme_gaze.checks import FloatArray
from likeme_gaze.simulation import SimulationSetup, blindfolded_experience

#: Movements with open eyes, and as many under the blindfold, that an agent learned from.
DETECTION_POINTS = 50
#: Random stream other than those of Fig 6's groups.
STREAM = 100


def blindfold_probabilities(seed: int, agent: int, points: int = DETECTION_POINTS) -> FloatArray:
    """P(blindfolded) by one agent after each movement (EXECUTIONS, 2, TRIALS).

    Second axis: mentors with open eyes, and mentors under an opaque blindfold.
    """
    rng, scene = np.random.default_rng([seed, STREAM, agent]), SimulationSetup()
    model = infant(rng, WornBlindfold.OPAQUE, points=points)
    sides = rng.permutation([1.0, -1.0] * (TRIALS // 2))
    mentors = np.stack([mentor_turns(rng, sides, scene), _unseeing(rng, scene)], axis=1)
    prior = Gaussian(*(np.stack([part, part]) for part in trial_prior(scene)))
    return np.array(
        [blindfold_probability(model, prior, mentors[: k + 1]) for k in range(EXECUTIONS)]
    )


def detection_correct(probabilities: FloatArray) -> NDArray[np.bool_]:
    """Whether the more probable kind is the true one, from P(blindfolded) (..., 2, TRIALS)."""
    return np.asarray((probabilities > 0.5) == np.array([[False], [True]]))


def _unseeing(rng: np.random.Generator, setting: SimulationSetup) -> FloatArray:
    """Movements under an opaque blindfold, each begun facing the agent (EXECUTIONS, TRIALS, 2)."""
    memory = blindfolded_experience(rng, EXECUTIONS * TRIALS, setting)
    final = memory.final - np.stack([memory.start, np.zeros_like(memory.start)], axis=-1)
    return final.reshape(EXECUTIONS, TRIALS, 2)
