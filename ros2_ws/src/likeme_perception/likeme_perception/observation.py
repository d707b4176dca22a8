"""What perception says about one frame, as values."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import nan

import numpy as np
from numpy.typing import NDArray

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.tabletop import State
from likeme_perception.hand_tip import HandTip
from likeme_perception.regions import UNIFORM, Probability
from likeme_perception.segmentation import Index, Shape


@dataclass(frozen=True, eq=False)
class ObjectObservation:
    """One catalogue object in one frame: the fields of likeme_msgs/ObjectState.

    state: None while something covers the object, or before it was seen. shape: last seen, None
    when never seen. pixels: flat indices in this frame's image.
    """

    name: str
    state: State | None = None
    state_probability: Probability = UNIFORM
    visible: bool = False
    settled: bool = False
    shape: Shape | None = None
    identity_probability: float = 0.0
    last_seen: int = 0
    pixels: Index = field(default_factory=lambda: np.zeros(0, np.intp))

    @property
    def state_name(self) -> str:
        """The state as a constant's name of likeme_msgs/ObjectState."""
        return 'UNKNOWN' if self.state is None else self.state.name

    @property
    def centroid(self) -> tuple[float, float, float]:
        """Middle of the surface, m; last seen value when not visible, NaN when never seen."""
        return self.shape.centroid if self.shape else (nan, nan, nan)


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

    @property
    def snapshot(self) -> TableSnapshot:
        """The known states alone: what an imitation session takes in."""
        states = {o.name: o.state for o in self.objects if o.state is not None}
        return TableSnapshot(self.stamp, self.frame_id, self.settled, states)

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
