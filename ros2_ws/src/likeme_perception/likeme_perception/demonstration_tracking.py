"""Detection of demonstrations: a hand enters, an object changes its state, the hand leaves."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

from likeme_core.observations import Demonstration, ObservedAttempt
from likeme_core.stamps import seconds
from likeme_perception.act_manner import act_manner, moved_at
from likeme_perception.attempt_tracking import AttemptTracker
from likeme_perception.config import PerceptionConfig
from likeme_perception.observation import (
    ObjectObservation,
    TableObservation,
    UnresolvedAct,
    UnresolvedReason,
)
from likeme_perception.rise_estimation import MOVED_DISTANCE, TrackSample, horizontal_distance


@dataclass
class HandEpisode:
    """What was seen from the frame in which a hand entered until its act is complete.

    before: the objects at rest when the hand entered. left: stamp at which the hand left, None
    while it is in view. with_arm: whether hand and arm were in view together.
    """

    start: int
    before: dict[str, ObjectObservation]
    left: int | None = None
    samples: dict[str, list[TrackSample]] = field(default_factory=dict)
    with_arm: bool = False


class CompletedActs(NamedTuple):
    """What a frame told of acts.

    demonstrations, unresolved: of a hand that has left; the latter could not be resolved.
    attempts: acts that are under way since this frame, or ended in it.
    """

    demonstrations: tuple[Demonstration, ...] = ()
    unresolved: tuple[UnresolvedAct, ...] = ()
    attempts: tuple[ObservedAttempt, ...] = ()


class DemonstrationTracker:
    """Turns the observations of successive frames into demonstrations.

    A change without a hand (by the robot, or by setting up the table anew) is no demonstration.
    Neither is a change while hand and arm are in view together, since its author is not known, nor
    one of an object that lies where it did, on a border.
    If an object that the hand moved is not at rest by `settle_timeout`, or when the arm comes, the
    act is unresolved; so it is if the object is not seen when a hand comes back. The state in
    which the object comes to rest later is not attributed to the next act.

    Attributes:
        unresolved: number of unresolved acts by reason.
    """

    def __init__(self, config: PerceptionConfig) -> None:
        self._config = config
        self._settled: dict[str, ObjectObservation] = {}
        self._episode: HandEpisode | None = None
        self._last: TableObservation | None = None
        self._attempts: AttemptTracker | None = None
        self.unresolved: Counter[UnresolvedReason] = Counter()

    def update(self, now: TableObservation) -> CompletedActs:
        """Process one frame; the acts that it completes, in the order the objects moved."""
        before, self._last = self._last, now
        earlier = CompletedActs()
        if before is not None and self._returns_to_lost(before, now):
            earlier = self._end(before)
        if self._episode is None and now.hand_in_view:
            self._episode = HandEpisode(now.stamp, dict(self._settled))
            self._attempts = AttemptTracker(self._config, self._settled)
        if self._episode is None or self._attempts is None:
            self._store_settled(now)
            return CompletedActs()
        self._record(self._episode, now)
        attempts = earlier.attempts + self._attempts.update(now)
        if not self._complete(self._episode, now):
            return earlier._replace(attempts=attempts)
        acts = self._end(now)
        return acts._replace(attempts=attempts + acts.attempts)

    def _returns_to_lost(self, before: TableObservation, now: TableObservation) -> bool:
        """Whether a hand comes back when one has left and something is not seen where it lay.

        By then, as the frame before shows, what was left at rest in view would be known to rest.
        What happened to the rest, by which hand, cannot be told.
        """
        episode, config = self._episode, self._config
        return (
            episode is not None
            and episode.left is not None
            and now.hand_in_view
            and seconds(now.stamp - episode.left) >= config.hand_gone_time + config.settle_time
            and any(
                o.name in episode.before and not (o.settled or o.visible) for o in before.objects
            )
        )

    def _end(self, now: TableObservation) -> CompletedActs:
        """End the episode with what is seen now."""
        assert self._episode is not None, 'There is one.'
        assert self._attempts is not None, 'It has them.'
        episode, self._episode = self._episode, None
        self._store_settled(now)
        lost = [o for o in now.objects if not o.settled and o.name in episode.before]
        acts = CompletedActs(
            self._demonstrations(episode, now),
            _unresolved_acts(episode, lost, now),
            self._attempts.ended(),
        )
        for each in lost:
            # Seen again, it may have been moved by this hand, or by the next one.
            self._settled.pop(each.name, None)
        self.unresolved.update(act.reason for act in acts.unresolved)
        return acts

    def interrupt(self, stamp: int) -> CompletedActs:
        """Give up the act in progress: its hand stopped moving and may hold something.

        What is at rest keeps the state it had before, so that the act counts when it goes on.
        """
        if self._episode is None or self._attempts is None:
            return CompletedActs()
        self._episode = None
        act = UnresolvedAct(stamp, None, UnresolvedReason.STILL)
        self.unresolved[act.reason] += 1
        return CompletedActs((), (act,), self._attempts.ended())

    def _store_settled(self, now: TableObservation) -> None:
        self._settled |= {o.name: o for o in now.objects if o.settled}

    def _record(self, episode: HandEpisode, now: TableObservation) -> None:
        if now.hand_in_view:
            episode.left = None
        elif episode.left is None:
            episode.left = now.stamp
        # The robot may start as soon as the hand has left; only both in view leave a doubt.
        episode.with_arm |= now.arm_in_view and now.hand_in_view
        for seen in now.objects:
            place = seen.centroid if seen.visible else None
            sample = TrackSample(now.stamp, place, now.hand_tip if now.hand_in_view else None)
            episode.samples.setdefault(seen.name, []).append(sample)

    def _complete(self, episode: HandEpisode, now: TableObservation) -> bool:
        """Whether the hand has left and all objects are at rest, or the wait for them is over."""
        if episode.left is None:
            return False
        gone = seconds(now.stamp - episode.left)
        # What was not understood before the act, and is not now, is not waited for.
        at_rest = all(
            o.settled or not (o.visible or o.name in episode.before) for o in now.objects
        )
        return (gone >= self._config.hand_gone_time and at_rest) or (
            gone >= self._config.settle_timeout or now.arm_in_view
        )

    def _demonstrations(
        self, episode: HandEpisode, now: TableObservation
    ) -> tuple[Demonstration, ...]:
        if episode.with_arm:
            return ()
        changed = [
            (before, after)
            for name, before in episode.before.items()
            if (after := self._settled.get(name)) is not None
            and after.state != before.state
            and _lies_elsewhere(before, after)
        ]
        acts = [
            (
                moved_at(episode.samples.get(b.name, []), b, episode.start),
                self._demonstration(episode, b, a, now),
            )
            for b, a in changed
        ]
        return tuple(act for _, act in sorted(acts, key=lambda pair: pair[0]))

    def _demonstration(
        self,
        episode: HandEpisode,
        before: ObjectObservation,
        after: ObjectObservation,
        now: TableObservation,
    ) -> Demonstration:
        assert before.state is not None, 'Only settled objects are compared.'
        assert after.state is not None, 'Only settled objects are compared.'
        samples = episode.samples.get(before.name, [])
        told = act_manner(self._config, samples, before, after, episode.start, episode.left)
        return Demonstration(
            stamp=now.stamp,
            frame=now.frame_id,
            object=before.name,
            x_i=before.state,
            x_f=after.state,
            manner=told.manner,
            start=episode.start,
            end=episode.left or episode.start,
            x_i_probability=before.state_probability,
            x_f_probability=after.state_probability,
            manner_probability=told.probability,
            rise=told.rise,
        )


def _unresolved_acts(
    episode: HandEpisode, lost: list[ObjectObservation], now: TableObservation
) -> tuple[UnresolvedAct, ...]:
    """Acts whose author or end is not known; lost: objects that rested before, and do not now."""
    if episode.with_arm:
        return (UnresolvedAct(now.stamp, None, UnresolvedReason.HAND_AND_ARM),)
    return tuple(
        UnresolvedAct(now.stamp, o.name, _reason(o, now))
        for o in lost
        if _was_moved(episode.samples[o.name], episode.before[o.name])
    )


def _lies_elsewhere(before: ObjectObservation, after: ObjectObservation) -> bool:
    """Whether an object was moved; on a border noise alone changes its state."""
    if not (before.visible and after.visible):
        return True
    return horizontal_distance(before.centroid, after.centroid) > MOVED_DISTANCE


def _was_moved(samples: list[TrackSample], before: ObjectObservation) -> bool:
    """Whether the object was last seen away from where it lay."""
    places = [s.place for s in samples if s.place is not None]
    if not places:
        return False
    return not before.visible or horizontal_distance(places[-1], before.centroid) > MOVED_DISTANCE


def _reason(unsettled: ObjectObservation, now: TableObservation) -> UnresolvedReason:
    if now.arm_in_view:
        return UnresolvedReason.INTERRUPTED
    return UnresolvedReason.MOVING if unsettled.visible else UnresolvedReason.HIDDEN
