"""Demonstrations as events: a hand came, an object changed state, the hand left."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, hypot
from typing import NamedTuple

import numpy as np

from likeme_core.observations import Demonstration
from likeme_core.tabletop import Manner
from likeme_perception.config import PerceptionConfig
from likeme_perception.hand_tip import HandTip
from likeme_perception.observation import ObjectObservation, TableObservation

SECOND = 1_000_000_000
# An object is on its way once it has moved this far (m) from where it lay, and so is the hand that
# carries it once it is this far from both ends of the way.
_UNDER_WAY = 0.03
_CARRYING = 0.06
# A path of fewer sightings than this is judged by the hand instead.
_SIGHTINGS = 4


class Sample(NamedTuple):
    """An object and the hand's tip in one frame of an episode; place None while not visible."""

    stamp: int
    place: tuple[float, float, float] | None
    tip: HandTip | None


@dataclass
class Episode:
    """From the frame in which a hand came: the settled objects before, and what was seen since."""

    start: int
    before: dict[str, ObjectObservation]
    left: int | None = None
    samples: dict[str, list[Sample]] = field(default_factory=dict)
    robot: bool = False


class DemonstrationTracker:
    """Turns the observations of successive frames into demonstrations.

    What changes without a hand (the robot's own acts, a table set up anew) is no demonstration,
    nor is what changes while hand and arm are both over the table: nobody can say who did it.
    """

    def __init__(self, config: PerceptionConfig) -> None:
        self._config = config
        self._settled: dict[str, ObjectObservation] = {}
        self._episode: Episode | None = None
        self.shared_acts = 0

    @property
    def in_episode(self) -> bool:
        """Whether a hand has come and the act is not over."""
        return self._episode is not None

    def update(self, now: TableObservation) -> tuple[Demonstration, ...]:
        """Take one frame; the acts that are complete with it, in the order the objects moved."""
        if self._episode is None and now.hand_in_view:
            self._episode = Episode(now.stamp, dict(self._settled))
        if self._episode is None:
            self._remember(now)
            return ()
        self._watch(self._episode, now)
        if not self._over(self._episode, now):
            return ()
        episode, self._episode = self._episode, None
        self._remember(now)
        return self._acts(episode, now)

    def _remember(self, now: TableObservation) -> None:
        self._settled |= {o.name: o for o in now.objects if o.settled}

    def _watch(self, episode: Episode, now: TableObservation) -> None:
        if now.hand_in_view:
            episode.left = None
        elif episode.left is None:
            episode.left = now.stamp
        # The robot may start right after the hand has left; only a shared table is in doubt.
        episode.robot |= now.arm_in_view and now.hand_in_view
        for seen in now.objects:
            place = seen.centroid if seen.visible else None
            sample = Sample(now.stamp, place, now.hand_tip if now.hand_in_view else None)
            episode.samples.setdefault(seen.name, []).append(sample)

    def _over(self, episode: Episode, now: TableObservation) -> bool:
        """Whether the hand has been gone for long enough and all rests, or never will."""
        if episode.left is None:
            return False
        gone = (now.stamp - episode.left) / SECOND
        at_rest = all(o.settled for o in now.objects)
        return (gone >= self._config.hand_gone_time and at_rest) or (
            gone >= self._config.settle_timeout or now.arm_in_view
        )

    def _acts(self, episode: Episode, now: TableObservation) -> tuple[Demonstration, ...]:
        if episode.robot:
            self.shared_acts += 1
            return ()
        changed = [
            (before, after)
            for name, before in episode.before.items()
            if (after := self._settled.get(name)) is not None and after.state != before.state
        ]
        acts = [(self._moved_at(episode, b), self._act(episode, b, a, now)) for b, a in changed]
        return tuple(act for _, act in sorted(acts, key=lambda pair: pair[0]))

    def _moved_at(self, episode: Episode, before: ObjectObservation) -> int:
        """Stamp of the first frame in which the object was not where it lay."""
        for sample in episode.samples.get(before.name, []):
            if sample.place is None or _apart(sample.place, before.centroid) > _UNDER_WAY:
                return sample.stamp
        return episode.start

    def _act(
        self,
        episode: Episode,
        before: ObjectObservation,
        after: ObjectObservation,
        now: TableObservation,
    ) -> Demonstration:
        assert before.state is not None, 'Only settled objects are compared.'
        assert after.state is not None, 'Only settled objects are compared.'
        rise = rise_of(episode.samples.get(before.name, []), before, after)
        c = self._config
        place = 1 / (1 + exp(min(50.0, -(rise - c.place_rise) / c.place_rise_scale)))
        return Demonstration(
            stamp=now.stamp,
            frame=now.frame_id,
            object=before.name,
            x_i=before.state,
            x_f=after.state,
            manner=Manner.PLACE if place >= 0.5 else Manner.PUSH,
            start=episode.start,
            end=episode.left or episode.start,
            x_i_probability=before.state_probability,
            x_f_probability=after.state_probability,
            manner_probability=max(place, 1 - place),
            rise=rise,
        )


def rise_of(samples: list[Sample], before: ObjectObservation, after: ObjectObservation) -> float:
    """Greatest height (m) the object gained on its way, or the hand that covered it.

    Frames in which the object is seen under way speak first. When there are too few, the hand's
    tip does, while it is away from both ends of the way: at the ends it comes down and goes up
    again however the object is moved.
    """
    start = before.centroid
    end = after.centroid if after.visible else None
    seen = [
        s.place[2] - start[2]
        for s in samples
        if s.place is not None
        and _apart(s.place, start) > _UNDER_WAY
        and (end is None or _apart(s.place, end) > _UNDER_WAY)
    ]
    lifted = [
        s.place[2] - start[2]
        for s in samples
        if s.place is not None and _apart(s.place, start) <= _UNDER_WAY
    ]
    if len(seen) >= _SIGHTINGS:
        return max(0.0, _robust_greatest(seen + lifted))
    return max(0.0, _robust_greatest(seen + lifted), _hand_rise(samples, start, end))


def _hand_rise(
    samples: list[Sample],
    start: tuple[float, float, float],
    end: tuple[float, float, float] | None,
) -> float:
    """How much higher (m) than at its lowest the hand was while carrying out of sight."""
    tips = [(s.tip, s.place) for s in samples if s.tip is not None]
    if not tips:
        return 0.0
    lowest = min(tip.low for tip, _ in tips)
    began = next((k for k, (tip, _) in enumerate(tips) if tip.low < lowest + 0.03), 0)
    way = [
        tip.low - lowest
        for tip, place in tips[began:]
        if place is None
        and hypot(tip.x - start[0], tip.y - start[1]) > _CARRYING
        and (end is None or hypot(tip.x - end[0], tip.y - end[1]) > _CARRYING)
    ]
    return _robust_greatest(way) if len(way) >= 3 else 0.0


def _robust_greatest(values: list[float]) -> float:
    """The greatest value but for one outlier in ten."""
    return float(np.percentile(values, 90)) if values else 0.0


def _apart(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return hypot(a[0] - b[0], a[1] - b[1])
