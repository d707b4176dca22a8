"""Attempts: a hand's acts on objects, from when they are under way, wherever they end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import dist

import numpy as np

from likeme_core.observations import ObservedAttempt
from likeme_core.regions import Regions
from likeme_core.stamps import nanoseconds
from likeme_core.tabletop import Manner, State
from likeme_perception.act_manner import act_manner
from likeme_perception.config import PerceptionConfig
from likeme_perception.manner_recognition import manner_probability
from likeme_perception.movement_direction import Point, moved_towards
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.rise_estimation import MOVED_DISTANCE, TrackSample, horizontal_distance
from likeme_perception.state_probability import regions_of

#: Frames in succession in which an object must be away from where it lay. In the simulated cell
#: what no hand moves is seen at most 0.015 m from its place and 0.008 m higher, whatever covers
#: it; MOVED_DISTANCE (0.03 m) and `place_rise` (0.035 m) are beyond both.
LEAST_FRAMES = 2


@dataclass
class _Act:
    """One object since it was last at rest.

    first: whether the hand came since. away: what was seen of it off its place. frames: how many
    in succession. begun: stamp of the first of them, once they are enough. told: manner and
    direction as last reported. rest: place and stamp since which it has not moved or fallen.
    """

    before: ObjectObservation
    first: bool = True
    samples: list[TrackSample] = field(default_factory=list)
    away: list[TrackSample] = field(default_factory=list)
    frames: int = 0
    begun: int | None = None
    told: tuple[Manner | None, State | None] | None = None
    rest: tuple[Point, int] | None = None


class AttemptTracker:
    """The attempts of one visit of a hand.

    An act ends when the object is at rest, seen whole and with no hand beside it, or with the
    visit: one visit can hold several acts on one object. Acts that begin while hand and arm are in
    view together are left out; of one that is under way then the end is not known.
    """

    def __init__(self, config: PerceptionConfig, at_rest: Mapping[str, ObjectObservation]) -> None:
        """at_rest: the objects before the hand came."""
        self._config = config
        self._acts = {name: _Act(before) for name, before in at_rest.items()}
        self._regions: Regions | None = None
        if config.world is not None:
            self._regions = regions_of(config, config.world.table.top)
        self._with_arm = False
        self._start, self._now = 0, TableObservation(0, '')
        self._left: int | None = None

    def update(self, now: TableObservation) -> tuple[ObservedAttempt, ...]:
        """Process one frame: what begins to be known, and what ends."""
        self._now = now
        self._start = self._start or now.stamp
        if now.hand_in_view:
            self._left = None
        elif self._left is None:
            self._left = now.stamp
        self._with_arm |= now.hand_in_view and now.arm_in_view
        found = []
        for seen in now.objects:
            act = self._acts.get(seen.name)
            if act is not None:
                self._record(act, seen)
                found += self._reported(act, seen)
        return tuple(found)

    def ended(self) -> tuple[ObservedAttempt, ...]:
        """The attempts that are under way when the visit is over."""
        at_rest = {o.name: o for o in self._now.objects if o.settled and not self._with_arm}
        open_acts = [(name, act) for name, act in self._acts.items() if act.begun is not None]
        return tuple(self._finished(act, at_rest.get(name)) for name, act in open_acts)

    def _record(self, act: _Act, seen: ObjectObservation) -> None:
        now = self._now
        place = seen.centroid if seen.visible else None
        sample = TrackSample(now.stamp, place, now.hand_tip if now.hand_in_view else None)
        act.samples.append(sample)
        if place is not None and (
            act.rest is None or dist(place, act.rest[0]) > self._config.rest_radius
        ):
            act.rest = place, now.stamp
        if self._is_away(act.before, seen):
            act.away.append(sample)
            act.frames += 1
        elif seen.visible:
            act.frames = 0
            if act.begun is None:
                act.away.clear()

    def _is_away(self, before: ObjectObservation, seen: ObjectObservation) -> bool:
        """Whether an object is off its place at rest."""
        elsewhere = None if self._regions is None else self._regions.elsewhere
        if not seen.visible:
            return seen.settled and seen.state is not None and seen.state != before.state
        if not before.visible:
            return seen.state != elsewhere
        rise = seen.centroid[2] - before.centroid[2]
        moved = horizontal_distance(seen.centroid, before.centroid) > MOVED_DISTANCE
        return moved or rise > self._config.place_rise

    def _reported(self, act: _Act, seen: ObjectObservation) -> list[ObservedAttempt]:
        if act.begun is None:
            if act.frames < LEAST_FRAMES or self._with_arm:
                return []
            act.begun = act.away[0].stamp
        if seen.settled and self._lies(act, seen):
            ended = self._finished(act, None if self._with_arm else seen)
            self._acts[seen.name] = _Act(seen, first=False)
            return [ended]
        manner, p = self._manner_so_far(act)
        told = manner, self._direction(act)
        if act.told is not None and all(
            new in (None, old) for new, old in zip(told, act.told, strict=True)
        ):
            return []
        act.told = told
        return [self._attempt(act, manner, p)]

    def _lies(self, act: _Act, seen: ObjectObservation) -> bool:
        """Whether what has settled is not in the air: a track settles by x and y alone."""
        if not seen.visible or act.rest is None:
            return True
        return self._now.stamp - act.rest[1] >= nanoseconds(self._config.settle_time)

    def _finished(self, act: _Act, after: ObjectObservation | None) -> ObservedAttempt:
        """The attempt of which the end was seen, or not: None."""
        if after is None:
            manner, p = self._manner_so_far(act)
        else:
            start = self._start if act.first else act.samples[0].stamp
            found = act_manner(
                self._config, act.samples, act.before, after, start, self._left, _rise(act)
            )
            manner, p = found.manner, found.probability
        return self._attempt(act, manner, p, after, under_way=False)

    def _attempt(
        self, act: _Act, manner: Manner | None, probability: float,
        after: ObjectObservation | None = None, under_way: bool = True,
    ) -> ObservedAttempt:  # fmt: skip
        before = act.before
        assert before.state is not None, 'Only objects that were at rest are tracked.'
        assert act.begun is not None, 'Only acts that have begun are reported.'
        return ObservedAttempt(
            stamp=self._now.stamp,
            frame=self._now.frame_id,
            object=before.name,
            x_i=before.state,
            x_f=None if after is None else after.state,
            manner=manner,
            manner_probability=probability,
            direction=self._direction(act, after),
            under_way=under_way,
            start=act.begun,
            end=self._now.stamp,
            x_i_probability=before.state_probability,
            x_f_probability=() if after is None else after.state_probability,
        )

    def _manner_so_far(self, act: _Act) -> tuple[Manner | None, float]:
        """Manner and its probability; None if several manners lift, or the start was not seen."""
        c = self._config
        if not act.before.visible:
            return None, 0.0
        manners = () if c.world is None else c.world.manners
        p = manner_probability(_rise(act), c.place_rise, c.place_rise_scale, manners)
        if p[Manner.PUSH] >= 0.5:
            return Manner.PUSH, p[Manner.PUSH]
        lifting = [m for m in p if m.handling.grasped]
        return (lifting[0], p[lifting[0]]) if len(lifting) == 1 else (None, 0.0)

    def _direction(self, act: _Act, after: ObjectObservation | None = None) -> State | None:
        """The region that the object was moved towards."""
        seen = [sample.place for sample in act.away if sample.place is not None]
        before, least = act.before, self._config.place_rise
        # Nothing slides onto the table.
        lifted = not before.visible or _rise(act) > least
        vanished = not lifted and after is not None and not after.visible
        if before.visible:
            # After it was let go it may fall and roll anywhere.
            height = before.centroid[2] + least
            seen = [before.centroid, *(p for p in seen if not lifted or p[2] > height)]
        if self._regions is None or before.state is None or not seen:
            return None
        return moved_towards(self._regions, before.state, seen, lifted, vanished)


def _rise(act: _Act) -> float:
    """Height (m) that the object gained while it was away: the 90th percentile."""
    if not act.before.visible:
        return 0.0
    seen = [s.place[2] - act.before.centroid[2] for s in act.away if s.place is not None]
    return max(0.0, float(np.percentile(seen, 90))) if seen else 0.0
