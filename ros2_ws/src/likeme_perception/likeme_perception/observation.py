"""Observations: the result of perception for one frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from math import nan
from typing import NamedTuple

import numpy as np

from likeme_core.observations import Demonstration, ObservedAttempt, TableSnapshot, is_known
from likeme_core.tabletop import State
from likeme_core.world.values import UNKNOWN
from likeme_perception.blobs import Index
from likeme_perception.hand_tip import HandTip
from likeme_perception.state_probability import Probability
from likeme_perception.top_view import Shape
from likeme_perception.unknown_objects import UnknownObject


@dataclass(frozen=True, eq=False)
class ObjectObservation:
    """One catalogue object in one frame: the fields of likeme_msgs/ObjectState.

    state: None while the object may be hidden and before it was seen. state_probability: by the
    states' numbers; empty before the first frame. shape: as last seen, None if
    never seen. pixels: flat indices in this frame's image. reason: why the state is None, where
    that is known.
    """

    name: str
    state: State | None = None
    state_probability: Probability = ()
    visible: bool = False
    settled: bool = False
    shape: Shape | None = None
    identity_probability: float = 0.0
    last_seen: int = 0
    pixels: Index = field(default_factory=lambda: np.zeros(0, np.intp))
    reason: str = ''

    @property
    def state_name(self) -> str:
        """Name of the state in its world, or UNKNOWN."""
        return UNKNOWN if self.state is None else self.state.name

    @property
    def centroid(self) -> tuple[float, float, float]:
        """Centroid of the surface, m; as last seen when not visible, NaN if never seen."""
        return self.shape.centroid if self.shape else (nan, nan, nan)


class UnresolvedReason(StrEnum):
    """Why an act of a hand gave no demonstration."""

    MOVING = 'object still moving'
    HIDDEN = 'object hidden'
    INTERRUPTED = 'arm came before object was at rest'
    HAND_AND_ARM = 'hand and arm in view together'
    STILL = 'hand stopped moving'


class UnresolvedAct(NamedTuple):
    """An act of a hand that gave no demonstration; object: None if it is not known."""

    stamp: int
    object: str | None
    reason: UnresolvedReason


@dataclass(frozen=True, eq=False)
class TableObservation:
    """Objects, hand and arm in one frame.

    learned: whether the background is known; without it there are no objects. demonstrations,
    unresolved: acts completed by this frame. attempts: acts that it shows to be under way or to
    have ended. hand, arm: pixels, flat indices. unknown_objects: what else is on the table and
    touches neither hand nor arm. reason: why the frame tells nothing, so that every state is
    unknown; empty if it was read.
    """

    stamp: int
    frame_id: str
    learned: bool = True
    hand_in_view: bool = False
    arm_in_view: bool = False
    settled: bool = False
    objects: tuple[ObjectObservation, ...] = ()
    demonstrations: tuple[Demonstration, ...] = ()
    unresolved: tuple[UnresolvedAct, ...] = ()
    attempts: tuple[ObservedAttempt, ...] = ()
    hand_tip: HandTip | None = None
    hand: Index = field(default_factory=lambda: np.zeros(0, np.intp))
    arm: Index = field(default_factory=lambda: np.zeros(0, np.intp))
    unknown_objects: tuple[UnknownObject, ...] = ()
    reason: str = ''

    @property
    def snapshot(self) -> TableSnapshot:
        """The known states, as input of an imitation session."""
        states = {
            o.name: o.state
            for o in self.objects
            if o.state is not None and is_known(o.state_probability)
        }
        return TableSnapshot(self.stamp, self.frame_id, self.settled, states)

    def object(self, name: str) -> ObjectObservation:
        """The object of that name.

        Raises:
            ValueError: there is none.
        """
        for found in self.objects:
            if found.name == name:
                return found
        raise ValueError(f'Expected one of {[o.name for o in self.objects]}, got {name!r}.')
