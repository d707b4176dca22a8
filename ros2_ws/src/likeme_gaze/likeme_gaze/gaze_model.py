"""A trained agent as a frozen value: what it knows of its own head, blindfolded too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from likeme_gaze.chain import HeadModel
from likeme_gaze.checks import FloatArray
from likeme_gaze.gaussian_processes import GaussianProcesses
from likeme_gaze.simulation import Experience, SimulationSetup, experience_of, self_experience
from likeme_gaze.training import Search, fit


@dataclass(frozen=True)
class GazeModel:
    """What an agent learned of its own head movements, and applies to a mentor ("Like me").

    Attributes:
        head: policy π and transition f.
        blindfold: the policy π_B under a blindfold; None without that experience.
        points: how many head movements `head` was learned from.
        seed: of the simulated experience; None when the experience came from elsewhere.
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
        search: Search | None = None,
        seed: int | None = None,
    ) -> GazeModel:
        """Train on experience, and on that with a blindfold where there is any.

        Raises:
            ValueError: too few movements, shapes that do not fit, or numbers that are not finite.
        """
        memory = experience_of(*experience)
        transition = fit(_columns(memory.action, memory.start), memory.final, search)
        hooded = None if blindfolded is None else _policy(experience_of(*blindfolded), search)
        head = HeadModel(_policy(memory, search), transition)
        return cls(head, hooded, len(memory.goal), seed)

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
        """The agent's own model put in the mentor's place.

        An agent that never wore a blindfold knows no difference (Fig 1b).
        """
        if blindfolded and self.blindfold is not None:
            return HeadModel(self.blindfold, self.head.transition)
        return self.head


def _policy(memory: Experience, search: Search | None) -> GaussianProcesses:
    return fit(_columns(memory.goal, memory.start), memory.action, search)


def _columns(first: FloatArray, start: FloatArray) -> FloatArray:
    return np.concatenate([first, start[:, None]], axis=1)
