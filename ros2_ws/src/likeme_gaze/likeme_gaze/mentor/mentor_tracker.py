"""Tracking one mentor at a time: a start pose, then head poses, each answered by an estimate."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from likeme_gaze import Following, Gaussian, GazeFollower, GazeModel, Pose2
from likeme_gaze.mentor.head_pose import (
    CM_PER_M,
    MAX_POSITION,
    HeadPose,
    PlanarHead,
    belief_in_m,
    in_m,
    project_to_plane,
)
from likeme_gaze.mentor.rejections import RejectedInputError
from likeme_gaze.mentor.settings import TrackingSettings

SECOND = 1_000_000_000
#: Two start poses in a row that go back by more, ns, mean that time restarted (a bag, a new cell).
TIME_JUMP = SECOND
#: Unmatched head poses, and unmatched distances, that are kept.
MAX_UNMATCHED = 10


class GazeEstimate(NamedTuple):
    """Estimate after a message; m and rad, in the robot's frame.

    Attributes:
        stamp: of the head pose, ns.
        height: of the mentor's eyes at its start pose, m.
        observations: head poses since the start pose.
        mentor_start: the mentor's head before it moved.
        mentor: its head now.
        robot: the robot's head after its action, by the predicted final state.
        goal: posterior of the goal (2,); None before the first observation.
        neck: mean and standard deviation of the neck angle that fixates the goal.
        turn: whether this was the last observation, after which the robot turns its head.
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


class _TrackedMentor(NamedTuple):
    """The mentor being tracked."""

    follower: GazeFollower
    head: PlanarHead


class MentorTracker:
    """Turns head poses into goal estimates; every rejected input is a ValueError.

    A start pose that cannot be used ends the trial before it, so that poses of two mentors are
    never combined; any other rejected input changes nothing.
    """

    def __init__(self, model: GazeModel, settings: TrackingSettings) -> None:
        """Track with a trained model; there is no mentor yet."""
        self.model, self.settings = model, settings
        self._mentor: _TrackedMentor | None = None
        self._last_stamp: int | None = None
        self._went_back = False
        self._poses: dict[int, HeadPose] = {}
        self._distances: dict[int, float] = {}

    @property
    def observations(self) -> int | None:
        """Head poses of this mentor used so far; None without a start pose."""
        return None if self._mentor is None else self._mentor.follower.observations

    def start(self, head: HeadPose) -> GazeEstimate:
        """Start a trial: the mentor's head before it moves.

        Raises:
            ValueError: a stamp not after the last one, or a pose that cannot be used.
        """
        self._check_start_stamp(head.stamp)
        self._mentor = None
        self._poses, self._distances = {}, {}
        seen = project_to_plane(head, self.settings.frames)
        follower = self._follower(seen.pose)
        follower.start(seen.pose, self.settings.blindfolded)
        self._mentor, self._last_stamp = _TrackedMentor(follower, seen), head.stamp
        return self._estimate(self._mentor, seen.pose, head.stamp, None)

    def observe(self, head: HeadPose) -> GazeEstimate | None:
        """Add an observation, the head after a turn; None until its distance arrives.

        Raises:
            ValueError: no start pose yet, all observations made, a stamp not after the last one,
                or a pose that cannot be used.
        """
        if not self.settings.use_distance:
            return self._observe(head, None)
        self._check_stamp(head.stamp)
        if head.stamp in self._distances:
            return self._observe(head, self._distances.pop(head.stamp))
        if len(self._poses) == MAX_UNMATCHED:
            self._poses.pop(min(self._poses))
            self._poses[head.stamp] = head
            raise RejectedInputError(
                'no distance',
                'Expected a mentor/fixation_distance with the stamp of every head pose, got none '
                f'for {MAX_UNMATCHED + 1} of them.',
            )
        self._poses[head.stamp] = head
        return None

    def observe_distance(self, stamp: int, distance: float) -> GazeEstimate | None:
        """Add the fixation distance, m, of the head pose with this stamp; None until that arrives.

        Raises:
            ValueError: a distance out of range, or as `observe`.
        """
        if not self.settings.use_distance:
            return None
        if not 0 < distance <= MAX_POSITION:
            raise RejectedInputError(
                'distance',
                f'Expected a distance above 0 and up to {MAX_POSITION:g} m, got {distance:g}.',
            )
        if stamp in self._poses:
            return self._observe(self._poses.pop(stamp), distance)
        self._distances[stamp] = distance
        if len(self._distances) > MAX_UNMATCHED:
            self._distances.pop(min(self._distances))
        return None

    def _observe(self, head: HeadPose, distance: float | None) -> GazeEstimate:
        mentor = self._check_stamp(head.stamp)
        seen = project_to_plane(head, self.settings.frames)
        cm = None if distance is None else distance * CM_PER_M
        following = mentor.follower.observe(seen.pose, cm)
        self._last_stamp = head.stamp
        return self._estimate(mentor, seen.pose, head.stamp, following)

    def _check_stamp(self, stamp: int) -> _TrackedMentor:
        if self._mentor is None or self._last_stamp is None:
            raise RejectedInputError(
                'no start pose',
                'Expected a mentor/head_pose/start before the first mentor/head_pose, got none.',
            )
        wanted = self.settings.observations
        if self._mentor.follower.observations >= wanted:
            raise RejectedInputError(
                'enough seen',
                f'Expected {wanted} head poses after a start pose, got one more.',
            )
        if stamp <= self._last_stamp:
            raise RejectedInputError('stamp', _not_after(self._last_stamp, stamp))
        return self._mentor

    def _check_start_stamp(self, stamp: int) -> None:
        """Reject a late start pose, but accept the second one in a row that jumps back in time."""
        last = self._last_stamp
        if last is None or stamp > last:
            self._went_back = False
            return
        jumped, self._went_back = self._went_back, last - stamp > TIME_JUMP
        if not (jumped and self._went_back):
            raise RejectedInputError('stamp', _not_after(last, stamp))
        self._went_back = False

    def _follower(self, mentor: Pose2) -> GazeFollower:
        """A follower with the goal prior for a mentor at this pose."""
        settings = self.settings
        dx, dy = settings.prior_offset
        x, y = (settings.head.x + mentor.x) / 2 + dx, (settings.head.y + mentor.y) / 2 + dy
        along = Pose2(x, y, math.atan2(mentor.y - settings.head.y, mentor.x - settings.head.x))
        spread = Gaussian(np.zeros(2), np.diag(np.square(settings.prior_std)))
        prior = along.belief_to_parent(spread)
        return GazeFollower(
            self.model, settings.head, settings.heading, prior, settings.most_moved
        )

    def _estimate(
        self, mentor: _TrackedMentor, now: Pose2, stamp: int, following: Following | None
    ) -> GazeEstimate:
        seen, robot = mentor.follower.observations, self.settings.head
        neck, final, goal = (self.settings.heading, 0.0), self.settings.heading, None
        if following is not None:
            turn, variance = following.action.mean[0], following.action.covariance[0, 0]
            neck = (self.settings.heading + float(turn), math.sqrt(variance))
            final = float(following.final.mean[0])
            goal = belief_in_m(robot.belief_to_parent(following.goal))
        return GazeEstimate(
            stamp,
            mentor.head.height,
            seen,
            in_m(mentor.head.pose),
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
