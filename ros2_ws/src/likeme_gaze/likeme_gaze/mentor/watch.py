"""One mentor after the other: a start pose, then head poses, and what they say about the goal."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from likeme_gaze import Following, Gaussian, GazeFollower, GazeModel, Pose2
from likeme_gaze.mentor.head_pose import (
    CM_PER_M,
    HeadPose,
    Planar,
    belief_in_m,
    in_m,
    planar,
)
from likeme_gaze.mentor.refusals import RefusedError
from likeme_gaze.mentor.settings import Watching

SECOND = 1_000_000_000
#: A start pose that goes back by more, ns, twice in a row, is a recording that began again.
JUMP = SECOND
#: Head poses and distances that may wait for each other.
MOST_WAITING = 10


class Answer(NamedTuple):
    """What is believed after a message; m and rad, in the robot's frame.

    Attributes:
        stamp: of the head pose, ns.
        height: of the mentor's eyes when it started, m.
        observations: head poses since the start pose.
        mentor_start: the mentor's head before it moved.
        mentor: its head now.
        robot: the robot's head as it would look at the goal, by its predicted final state.
        goal: posterior of the goal (2,); None before the first observation.
        neck: mean and standard deviation of the neck's angle that looks at the goal.
        turn: whether this was the last observation, so that the robot turns its head.
    """

    stamp: int
    height: float
    observations: int
    mentor_start: Pose2
    mentor: Pose2
    robot: Pose2
    goal: Gaussian | None
    neck: tuple[float, float]
    turn: bool


class _Watched(NamedTuple):
    """The mentor that is being watched."""

    follower: GazeFollower
    head: Planar


class MentorWatch:
    """Takes head poses and answers with beliefs; every refusal is a ValueError.

    A start pose that cannot be read ends the mentor before it, so that nothing is inferred from
    two mentors mixed; every other refusal changes nothing.
    """

    def __init__(self, model: GazeModel, settings: Watching) -> None:
        """Watch with a trained model; nobody is there yet."""
        self.model, self.settings = model, settings
        self._watched: _Watched | None = None
        self._last_stamp: int | None = None
        self._went_back = False
        self._poses: dict[int, HeadPose] = {}
        self._distances: dict[int, float] = {}

    @property
    def observations(self) -> int | None:
        """How many head poses of this mentor were used; None without a start pose."""
        return None if self._watched is None else self._watched.follower.observations

    def start(self, head: HeadPose) -> Answer:
        """Begin with a mentor: its head before it moves.

        Raises:
            ValueError: older than what was seen before, or a pose that cannot be used.
        """
        self._check_start_stamp(head.stamp)
        self._watched = None
        self._poses, self._distances = {}, {}
        seen = planar(head, self.settings.frames)
        follower = self._follower(seen.pose)
        follower.start(seen.pose, self.settings.blindfolded)
        self._watched, self._last_stamp = _Watched(follower, seen), head.stamp
        return self._answer(self._watched, seen.pose, head.stamp, None)

    def observe(self, head: HeadPose) -> Answer | None:
        """Take the head after a movement; None while it waits for its distance.

        Raises:
            ValueError: no start pose yet, enough observations, not newer than the last one, or a
                pose that cannot be used.
        """
        if not self.settings.use_distance:
            return self._observe(head, None)
        self._check_stamp(head.stamp)
        if head.stamp in self._distances:
            return self._observe(head, self._distances.pop(head.stamp))
        if len(self._poses) == MOST_WAITING:
            self._poses.pop(min(self._poses))
            self._poses[head.stamp] = head
            raise RefusedError(
                'no distance',
                'Expected a mentor/fixation_distance with the stamp of every head pose, got none '
                f'for {MOST_WAITING + 1} of them.',
            )
        self._poses[head.stamp] = head
        return None

    def measure(self, stamp: int, distance: float) -> Answer | None:
        """Take the distance of the head pose with this stamp; None while that is not there yet.

        Raises:
            ValueError: a distance that is none, or as `observe`.
        """
        if not self.settings.use_distance:
            return None
        if not (math.isfinite(distance) and distance > 0):
            raise RefusedError(
                'distance', f'Expected a distance of more than 0 m, got {distance:g}.'
            )
        if stamp in self._poses:
            return self._observe(self._poses.pop(stamp), distance)
        self._distances[stamp] = distance
        if len(self._distances) > MOST_WAITING:
            self._distances.pop(min(self._distances))
        return None

    def _observe(self, head: HeadPose, distance: float | None) -> Answer:
        watched = self._check_stamp(head.stamp)
        seen = planar(head, self.settings.frames)
        cm = None if distance is None else distance * CM_PER_M
        following = watched.follower.observe(seen.pose, cm)
        self._last_stamp = head.stamp
        return self._answer(watched, seen.pose, head.stamp, following)

    def _check_stamp(self, stamp: int) -> _Watched:
        if self._watched is None or self._last_stamp is None:
            raise RefusedError(
                'no start pose',
                'Expected a mentor/head_pose/start before the first mentor/head_pose, got none.',
            )
        wanted = self.settings.observations
        if self._watched.follower.observations >= wanted:
            raise RefusedError(
                'enough seen',
                f'Expected {wanted} head poses after a start pose, got one more.',
            )
        if stamp <= self._last_stamp:
            raise RefusedError('stamp', _not_after(self._last_stamp, stamp))
        return self._watched

    def _check_start_stamp(self, stamp: int) -> None:
        """Refuse a late start pose, but not a second one that jumps back: time began anew."""
        last = self._last_stamp
        if last is None or stamp > last:
            self._went_back = False
            return
        jumped, self._went_back = self._went_back, last - stamp > JUMP
        if not (jumped and self._went_back):
            raise RefusedError('stamp', _not_after(last, stamp))
        self._went_back = False

    def _follower(self, mentor: Pose2) -> GazeFollower:
        """A follower with the prior for a mentor in this place."""
        wanted = self.settings
        dx, dy = wanted.prior_offset
        x, y = (wanted.head.x + mentor.x) / 2 + dx, (wanted.head.y + mentor.y) / 2 + dy
        along = Pose2(x, y, math.atan2(mentor.y - wanted.head.y, mentor.x - wanted.head.x))
        spread = Gaussian(np.zeros(2), np.diag(np.square(wanted.prior_std)))
        prior = along.belief_to_parent(spread)
        return GazeFollower(self.model, wanted.head, wanted.heading, prior, wanted.most_moved)

    def _answer(
        self, watched: _Watched, now: Pose2, stamp: int, following: Following | None
    ) -> Answer:
        seen, robot = watched.follower.observations, self.settings.head
        neck, final, goal = (self.settings.heading, 0.0), self.settings.heading, None
        if following is not None:
            turn, variance = following.action.mean[0], following.action.covariance[0, 0]
            neck = (self.settings.heading + float(turn), math.sqrt(variance))
            final = float(following.final.mean[0])
            goal = belief_in_m(robot.belief_to_parent(following.goal))
        return Answer(
            stamp,
            watched.head.height,
            seen,
            in_m(watched.head.pose),
            in_m(now),
            in_m(Pose2(robot.x, robot.y, robot.heading + final)),
            goal,
            neck,
            seen == self.settings.observations,
        )


def _not_after(last: int, stamp: int) -> str:
    return (
        f'Expected a stamp after that of the last head pose, {last / SECOND:.3f} s, got '
        f'{stamp / SECOND:.3f} s.'
    )
