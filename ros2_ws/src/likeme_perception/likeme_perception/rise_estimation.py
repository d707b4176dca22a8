"""Rise of an object during an act: how high it was lifted above where it lay."""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np

from likeme_perception.hand_tip import HandTip
from likeme_perception.observation import ObjectObservation

#: Horizontal distance (m) from its place at rest beyond which an object counts as moved.
MOVED_DISTANCE = 0.03
# The same for the hand that carries it, from both ends of the path.
_CARRY_DISTANCE = 0.06
# What is lower than where it lay by more than this, m, falls off the table: no sample of the way.
_FALLEN = 0.02
# With fewer samples of the object under way, the hand's height is used instead.
_LEAST_SAMPLES = 4
# Of the hand's tip, so many tell it; up to this height, m, above its lowest point it is down.
_LEAST_TIPS, _DOWN = 3, 0.03


class TrackSample(NamedTuple):
    """An object and the hand's tip in one frame of an act; place is None while not visible."""

    stamp: int
    place: tuple[float, float, float] | None
    tip: HandTip | None


class Rise(NamedTuple):
    """How high an object rose, m; not told: it may have risen higher where it was hidden."""

    height: float
    told: bool


def estimate_rise(
    samples: list[TrackSample], before: ObjectObservation, after: ObjectObservation
) -> Rise:
    """Greatest height (m) gained on the way, by the object or by the hand that hides it.

    Frames that show the object under way are preferred. If there are too few of them, the height
    of the hand's tip is used while it is away from both ends of the path: at the ends the hand
    goes down and up again however the object is moved. On a short path that is what it rises to
    between the first and the last time that it is down.
    """
    start = before.centroid
    end = after.centroid if after.visible else None
    under_way = [
        s.place[2] - start[2]
        for s in samples
        if s.place is not None
        and horizontal_distance(s.place, start) > MOVED_DISTANCE
        and (end is None or horizontal_distance(s.place, end) > MOVED_DISTANCE)
    ]
    at_start = [
        s.place[2] - start[2]
        for s in samples
        if s.place is not None and horizontal_distance(s.place, start) <= MOVED_DISTANCE
    ]
    rise = max(0.0, _robust_maximum(under_way + at_start))
    on_the_way = sum(height > -_FALLEN for height in under_way)
    if on_the_way >= _LEAST_SAMPLES:
        return Rise(rise, told=True)
    hand = _hand_rise(samples, start, end)
    hidden = sum(s.place is None and s.tip is not None for s in samples)
    seen = on_the_way > 0 and hidden < _LEAST_TIPS
    return Rise(max(rise, hand or 0.0), told=seen or hand is not None)


def _hand_rise(
    samples: list[TrackSample],
    start: tuple[float, float, float],
    end: tuple[float, float, float] | None,
) -> float | None:
    """Height (m) of the hand above its lowest point while it carries the object out of sight.

    None: it was not seen often enough on the way.
    """
    tips = [(s.tip, s.place) for s in samples if s.tip is not None]
    if not tips:
        return None
    lowest = min(tip.low for tip, _ in tips)
    down = [k for k, (tip, _) in enumerate(tips) if tip.low < lowest + _DOWN]
    carried = [
        tip.low - lowest
        for tip, place in tips[down[0] :]
        if place is None
        and hypot(tip.x - start[0], tip.y - start[1]) > _CARRY_DISTANCE
        and (end is None or hypot(tip.x - end[0], tip.y - end[1]) > _CARRY_DISTANCE)
    ]
    if len(carried) < _LEAST_TIPS:
        between = [tip.low - lowest for tip, place in tips[down[0] : down[-1]] if place is None]
        return _robust_maximum(between) if len(between) >= _LEAST_TIPS else None
    greatest, usual = _robust_maximum(carried), float(np.median(carried))
    # A hand that was low for most of the way has pushed; it rises when it leaves.
    return greatest if usual > greatest / 2 else usual


def _robust_maximum(values: list[float]) -> float:
    """The 90th percentile; 0 for no values."""
    return float(np.percentile(values, 90)) if values else 0.0


def horizontal_distance(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    """Distance of two points in the table plane, m."""
    return hypot(a[0] - b[0], a[1] - b[1])
