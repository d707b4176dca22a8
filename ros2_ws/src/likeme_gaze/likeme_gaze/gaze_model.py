"""A trained agent: models of its own head movements, with and without a blindfold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from likeme_gaze.chain import HeadModel
from likeme_gaze.checks import FloatArray
from likeme_gaze.gp.gaussian_processes import GaussianProcesses
from likeme_gaze.gp.training import HyperparameterSearch, fit
from likeme_gaze.simulation import Experience, SimulationSetup, experience_of, self_experience


@dataclass(frozen=True)
class GazeModel:
    """An agent's head model, learned from its own movements and attributed to mentors ("Like me").

    Attributes:
        head: policy π and transition f.
        blindfold: the policy π_B under a blindfold; None without that experience.
        points: number of head movements that `head` was trained on.
        seed: of the simulated experience; None for other experience.
    """

    head: HeadModel
    blindfold: GaussianProcesses | None = None
    points: int = 0
    seed: int | None = None

    @classmethod
    def learned(
        cls,
        experience: Experience,
        blindfolded: Experience | None = None,
        search: HyperparameterSearch | None = None,
        seed: int | None = None,
    ) -> GazeModel:
        """Train on experience, and on experience under a blindfold if given.

        Raises:
            ValueError: too few movements, wrong shapes, or values that are not finite.
        """
        movements = experience_of(*experience)
        transition = fit(_columns(movements.action, movements.start), movements.final, search)
        blindfold = None if blindfolded is None else _policy(experience_of(*blindfolded), search)
        head = HeadModel(_policy(movements, search), transition)
        return cls(head, blindfold, len(movements.goal), seed)

    @classmethod
    def simulated(
        cls, seed: int, points: int = 200, setting: SimulationSetup | None = None
    ) -> GazeModel:
        """Train on simulated self-experience (Gaze Following: Model Simulations).

        Raises:
            ValueError: too few points.
        """
        rng = np.random.default_rng(seed)
        return cls.learned(self_experience(rng, points, setting), seed=seed)

    def mentor_head(self, blindfolded: bool = False) -> HeadModel:
        """The head model attributed to the mentor: the agent's own.

        Blindfold experience replaces the policy for a blindfolded mentor (Fig 1b).
        """
        if blindfolded and self.blindfold is not None:
            return HeadModel(self.blindfold, self.head.transition)
        return self.head


def _policy(movements: Experience, search: HyperparameterSearch | None) -> GaussianProcesses:
    return fit(_columns(movements.goal, movements.start), movements.action, search)


def _columns(first: FloatArray, start: FloatArray) -> FloatArray:
    return np.concatenate([first, start[:, None]], axis=1)
