"""The manner of an act: what was seen of an object on its way from one rest to the next."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

from likeme_core.stamps import seconds
from likeme_core.tabletop import Manner
from likeme_perception.config import PerceptionConfig
from likeme_perception.manner_recognition import manner_probability, with_missing_frames
from likeme_perception.observation import ObjectObservation
from likeme_perception.rise_estimation import (
    MOVED_DISTANCE,
    TrackSample,
    estimate_rise,
    horizontal_distance,
)

#: s between two frames from which an object may have been moved unseen; 5 Hz is still enough to
#: tell all manners (bench.sh eyes).
LONGEST_PERIOD = 0.25


class ActManner(NamedTuple):
    """The most probable manner of an act, its probability, and the rise (m) it follows from."""

    manner: Manner
    probability: float
    rise: float


def act_manner(
    config: PerceptionConfig, samples: list[TrackSample], before: ObjectObservation,
    after: ObjectObservation, start: int, left: int | None, least_rise: float = 0.0,
) -> ActManner:  # fmt: skip
    """The manner of an act.

    Args:
        config: its thresholds.
        samples: of the object, frame by frame.
        before: the object at rest before the act.
        after: and after it.
        start: stamp at which the hand came.
        left: at which it left; None: it has not.
        least_rise: rise that the object is known to have had, m.
    """
    seen = estimate_rise(samples, before, after)
    rise = max(least_rise, seen.height)
    manners = () if config.world is None else config.world.manners
    p = manner_probability(rise, config.place_rise, config.place_rise_scale, manners)
    missing = _missing_share(samples, before, start, left) if seen.told else 1.0
    p = with_missing_frames(p, missing)
    # Of two that are equally likely, the one with the lower number.
    manner = min(p, key=lambda m: (-p[m], m))
    return ActManner(manner, p[manner], rise)


def moved_at(samples: list[TrackSample], before: ObjectObservation, start: int) -> int:
    """Stamp of the first frame in which the object was not where it lay; `start` if in none."""
    for sample in samples:
        if (
            sample.place is None
            or horizontal_distance(sample.place, before.centroid) > MOVED_DISTANCE
        ):
            return sample.stamp
    return start


def _missing_share(
    samples: list[TrackSample], before: ObjectObservation, start: int, left: int | None
) -> float:
    """Share of the time in which the object moved that lies between frames too far apart."""
    stamps = [s.stamp for s in samples]
    moved, until = moved_at(samples, before, start), left or start
    gaps = [
        seconds(b - a)
        for a, b in pairwise(stamps)
        if b >= moved and a <= until and seconds(b - a) > LONGEST_PERIOD
    ]
    return min(1.0, sum(gaps) / max(seconds(until - moved), LONGEST_PERIOD))
