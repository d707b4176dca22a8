"""All a robot learned by its own trials: a model per object, each count with its source."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.domain import Action, State
from likeme_inference.tabletop.transition_model import TransitionModel


class TrialCounts(NamedTuple):
    """What became of the trials of one action from one state, as one source reports them.

    Attributes:
        counts: how often the object ended in each state, shape [x_f].
        source: key of RobotModel.sources.
    """

    object: str
    x_i: State
    action: Action
    counts: tuple[int, ...]
    source: str


@dataclass(frozen=True)
class RobotModel:
    """A named, versioned collection of trial counts and the transition models that follow from it.

    Attributes:
        sources: key -> where the trials were made, for people.
        rows: at most one for each object, x_i, action and source; several sources add up.
    """

    name: str
    version: str
    sources: Mapping[str, str]
    rows: tuple[TrialCounts, ...]

    def __post_init__(self) -> None:
        keys = Counter((row.object, row.x_i, row.action, row.source) for row in self.rows)
        twice = next((key for key, n in keys.items() if n > 1), None)
        if twice is not None:
            raise ValueError(f'Expected each row once, got {keys[twice]} of {twice}.')
        nowhere = next((row for row in self.rows if row.source not in self.sources), None)
        if nowhere is not None:
            raise ValueError(
                f'Expected one of the sources {sorted(self.sources)}, got {nowhere.source!r}.'
            )
        object.__setattr__(self, 'sources', MappingProxyType(dict(self.sources)))

    @property
    def label(self) -> str:
        """Name and version, as messages and figures quote it."""
        return f'{self.name} {self.version}'

    @cached_property
    def objects(self) -> Mapping[str, TransitionModel]:
        """Object name -> its transition model, in order of first mention."""
        totals: dict[str, np.ndarray[tuple[int, ...], np.dtype[np.int64]]] = {}
        for row in self.rows:
            zero = np.zeros((len(State), len(Action), len(State)), dtype=np.int64)
            totals.setdefault(row.object, zero)[row.x_i, row.action] += row.counts
        return MappingProxyType({name: TransitionModel(counts) for name, counts in totals.items()})

    def model_of(self, name: str) -> TransitionModel:
        """Give the transition model of one object.

        Raises:
            ValueError: for an object the robot never tried.
        """
        if name not in self.objects:
            raise ValueError(f'Expected one of the objects {list(self.objects)}, got {name!r}.')
        return self.objects[name]
