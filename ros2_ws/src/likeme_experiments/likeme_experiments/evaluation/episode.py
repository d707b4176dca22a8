"""One demonstration and the robot's imitations of it, as perception reported them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from likeme_core.tabletop import Mode
from likeme_experiments.evaluation.forecast import Approach, DemonstrationCase


class PerceivedDemonstration(NamedTuple):
    """A demonstration as perception reported it."""

    x_i: int
    x_f: int
    manner: int


class ImitationResult(NamedTuple):
    """How one imitation ended.

    Attributes:
        actions: what the robot did, one after another.
        states: where the camera saw the object at rest after each; None: not seen.
        asked: whether the robot asked for help.
        helped: where the object was after the human helped; None: no help, or not seen.
        refused: number of the actions that were not begun, since other objects were in the way.
    """

    actions: tuple[int, ...]
    states: tuple[int | None, ...]
    asked: bool
    helped: int | None = None
    refused: int = 0

    def reached(self, x_f: int, approach: Approach) -> bool:
        """Whether the object came to rest in x_f, with human help if the approach allows it."""
        last = self.states[-1] if self.states else None
        return (self.helped if approach.helped and self.asked else last) == x_f


class ImitationEpisode(NamedTuple):
    """One human demonstration and the robot's imitations of it.

    Attributes:
        seed: number of the repetition, from 0.
        perceived: the demonstrations perception reported; correct is the intended one alone.
        results: estimate of p(X_f | X_i, A) -> mode -> result; empty if nothing was perceived.
    """

    case: DemonstrationCase
    seed: int
    perceived: tuple[PerceivedDemonstration, ...]
    results: Mapping[str, Mapping[Mode, ImitationResult]]

    @property
    def understood(self) -> bool:
        """Whether perception reported the intended demonstration and nothing else."""
        return self.perceived == (PerceivedDemonstration(*map(int, self.case[1:])),)
