"""Table states as a live trial needs them, and the conditions under which a trial is void."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import State
from likeme_inference.experience.trial import COUNTED, Place
from likeme_inference.tabletop.values import MotionReport


class TrialVoidError(Exception):
    """The current trial is void and has to be repeated; the message gives the reason."""


class NotFreeError(TrialVoidError):
    """Other objects are in the way of the action."""


class CellGoneError(Exception):
    """The cell's services or the table states are absent; the message says which."""


class ObservedObject(NamedTuple):
    """One object in one table state: state None if occluded, place None if not visible.

    ever_seen: by this run of perception; the arm does not act on what was never seen.
    """

    state: State | None
    place: Place | None
    ever_seen: bool = True


@dataclass(frozen=True)
class ObservedTable:
    """One table state; stamp in ns. settled: no hand, no arm, everything at rest."""

    stamp: int
    settled: bool
    objects: Mapping[str, ObservedObject]


def state_and_place(table: ObservedTable, name: str) -> tuple[State, Place | None]:
    """State and place of an object.

    Raises:
        TrialVoidError: an object that perception does not know, or that is occluded.
    """
    if name not in table.objects:
        known = ', '.join(sorted(table.objects))
        raise TrialVoidError(f'The camera knows {known}, not {name}.')
    state, place, _ = table.objects[name]
    if state is None:
        raise TrialVoidError(f'The {name} stayed covered from view.')
    return state, place


def require_counted_motion(report: MotionReport) -> None:
    """Check that a motion counts as a trial.

    Raises:
        NotFreeError: it was not begun, as other objects are in the way.
        TrialVoidError: it was stopped or never started.
    """
    if report.outcome == MotionOutcome.NOT_FREE:
        raise NotFreeError(f'The arm did not try: {report.message}')
    if report.outcome not in COUNTED:
        raise TrialVoidError(f'The arm did not try: {report.message}')
