"""One demonstration and the robot's imitations of it, as the camera saw them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from likeme_core.tabletop import Mode
from likeme_experiments.evaluation.forecast import Case, Way


class Act(NamedTuple):
    """A human act as the camera understood it."""

    x_i: int
    x_f: int
    manner: int


class Ending(NamedTuple):
    """How one imitation ended.

    Attributes:
        actions: what the robot did, one after another.
        states: where the camera saw the object at rest after each; None: not seen.
        asked: whether the robot asked for help.
        helped: where the object was after a person did what was asked; None: not done or not seen.
    """

    actions: tuple[int, ...]
    states: tuple[int | None, ...]
    asked: bool
    helped: int | None = None

    def reached(self, x_f: int, way: Way) -> bool:
        """Whether the object came to rest in x_f; by the person's hand where the way allows it."""
        by_hand = way.helped and self.asked
        last = self.states[-1] if self.states else None
        return (self.helped if by_hand else last) == x_f


class Episode(NamedTuple):
    """One demonstration by a person and the robot's imitations of it.

    Attributes:
        seed: of its chance, from 0.
        acts: what perception made of the demonstration; rightly one, as it was meant.
        endings: estimate of p(X_f | X_i, A) -> mode -> ending; no mode where no act was seen.
    """

    case: Case
    seed: int
    acts: tuple[Act, ...]
    endings: Mapping[str, Mapping[Mode, Ending]]

    @property
    def understood(self) -> bool:
        """Whether the camera saw what was meant, and nothing else."""
        return self.acts == (Act(*map(int, self.case[1:])),)
