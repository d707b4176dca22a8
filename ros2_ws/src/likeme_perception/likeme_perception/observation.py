"""What perception says about one frame, as values."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from math import nan

import numpy as np
from numpy.typing import NDArray

from likeme_perception.hand_tip import HandTip
from likeme_perception.regions import UNIFORM, Probability, State
from likeme_perception.segmentation import Index, Shape


class Manner(IntEnum):
    """How a person moved an object; the numbers of likeme_msgs/Demonstration."""

    PLACE = 0
    PUSH = 1


@dataclass(frozen=True, eq=False)
class ObjectObservation:
    """One catalogue object in one frame: the fields of likeme_msgs/ObjectState.

    shape: last seen, None when never seen. pixels: flat indices in this frame's image.
    """

    name: str
    state: State = State.UNKNOWN
    state_probability: Probability = UNIFORM
    visible: bool = False
    settled: bool = False
    shape: Shape | None = None
    identity_probability: float = 0.0
    last_seen: int = 0
    pixels: Index = field(default_factory=lambda: np.zeros(0, np.intp))

    @property
    def centroid(self) -> tuple[float, float, float]:
        """Middle of the surface, m; last seen value when not visible, NaN when never seen."""
        return self.shape.centroid if self.shape else (nan, nan, nan)


@dataclass(frozen=True)
class Demonstration:
    """One human act from start to end: the fields of likeme_msgs/Demonstration; stamps in ns."""

    object: str
    x_i: State
    x_f: State
    x_i_probability: Probability
    x_f_probability: Probability
    manner: Manner
    manner_probability: float
    rise: float
    start: int
    end: int


@dataclass(frozen=True, eq=False)
class TableObservation:
    """What is where in one frame.

    learned: the background is known; without it nothing is said about objects. things: pixels of
    what is in no catalogue. demonstrations: acts found complete in this frame.
    """

    stamp: int
    frame_id: str
    learned: bool = True
    hand_in_view: bool = False
    arm_in_view: bool = False
    settled: bool = False
    objects: tuple[ObjectObservation, ...] = ()
    demonstrations: tuple[Demonstration, ...] = ()
    hand_tip: HandTip | None = None
    hand: Index = field(default_factory=lambda: np.zeros(0, np.intp))
    arm: Index = field(default_factory=lambda: np.zeros(0, np.intp))
    things: tuple[tuple[Index, Shape], ...] = ()

    def object(self, name: str) -> ObjectObservation:
        """The object of that name."""
        for found in self.objects:
            if found.name == name:
                return found
        raise ValueError(f'Expected one of {[o.name for o in self.objects]}, got {name!r}.')

    def masks(self, shape: tuple[int, int]) -> dict[str, NDArray[np.bool_]]:
        """Image masks (H, W) of 'hand', 'arm' and every visible object by name."""
        named = {'hand': self.hand, 'arm': self.arm} | {o.name: o.pixels for o in self.objects}
        result = {}
        for name, pixels in named.items():
            mask = np.zeros(shape[0] * shape[1], bool)
            mask[pixels] = True
            result[name] = mask.reshape(shape)
        return result
