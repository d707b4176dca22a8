"""What the explorer needs of a table state, and what may be said of a trial in a live cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from likeme_core.tabletop import State
from likeme_inference.experience.trial import COUNTED, Place
from likeme_inference.tabletop.values import MotionReport


class TrialVoidError(Exception):
    """The trial under way says nothing and is made anew: one sentence says why."""


class CellGoneError(Exception):
    """Nobody serves the cell, or the camera is silent: one sentence."""


class SeenObject(NamedTuple):
    """One object in one table state: state None while covered, place None while not visible."""

    state: State | None
    place: Place | None


@dataclass(frozen=True)
class Sighting:
    """One table state. stamp: ns. settled: no hand, no arm, everything at rest."""

    stamp: int
    settled: bool
    objects: Mapping[str, SeenObject]


def seen_in(sighting: Sighting, name: str) -> tuple[State, Place | None]:
    """State and place of an object.

    Raises:
        TrialVoidError: it is in no catalogue, or something covers it.
    """
    if name not in sighting.objects:
        known = ', '.join(sorted(sighting.objects))
        raise TrialVoidError(f'The camera knows {known}, not {name}.')
    state, place = sighting.objects[name]
    if state is None:
        raise TrialVoidError(f'The {name} stayed covered from view.')
    return state, place


def counted(report: MotionReport) -> None:
    """Let a motion pass that says something about the robot's skill.

    Raises:
        TrialVoidError: it does not.
    """
    if report.outcome not in COUNTED:
        raise TrialVoidError(f'The arm did not try: {report.message}')
