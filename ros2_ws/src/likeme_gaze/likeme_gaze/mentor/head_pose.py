"""A head pose in space, m, to a pose in the plane of the gaze model, cm, in the robot's frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from likeme_gaze import Gaussian, Pose2
from likeme_gaze.checks import FloatArray
from likeme_gaze.mentor.refusals import RefusedError

#: The gaze model counts in cm.
CM_PER_M = 100.0
#: How far a quaternion's length may be from 1 to be normalised; beyond it is no rotation.
LENGTH_TOLERANCE = 0.01
#: A line of sight whose level part is shorter than this (84 degrees up or down) has no heading.
LEAST_LEVEL = 0.1


class HeadPose(NamedTuple):
    """A head in space.

    Attributes:
        stamp: ns.
        frame: name of the frame the rest is in; x forward, y left, z up.
        position: x, y, z in m.
        orientation: quaternion x, y, z, w; the head looks along its x axis.
    """

    stamp: int
    frame: str
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]


class Frames(NamedTuple):
    """The frames head poses may come in.

    Attributes:
        base: name of the robot's frame.
        mentor: name of the mentor's.
        mentor_pose: where the mentor's is in the robot's, cm and rad.
    """

    base: str
    mentor: str
    mentor_pose: Pose2


class Planar(NamedTuple):
    """A head in the plane.

    Attributes:
        pose: in the robot's frame, cm and rad.
        height: of the eyes, m.
    """

    pose: Pose2
    height: float


def planar(head: HeadPose, frames: Frames) -> Planar:
    """The head as the gaze model sees it.

    Raises:
        RefusedError: a frame that is not known, numbers that are not finite, an orientation that
            is no rotation or looks straight up or down.
    """
    if head.frame not in (frames.base, frames.mentor):
        raise RefusedError(
            'unknown frame',
            f'Expected a head pose in {frames.base} or {frames.mentor}, got {head.frame!r}.',
        )
    if not all(map(math.isfinite, head.position)):
        raise RefusedError(
            'not finite', f'Expected a position of finite numbers, got {_written(head.position)}.'
        )
    x, y, height = head.position
    pose = Pose2(x * CM_PER_M, y * CM_PER_M, heading(head.orientation))
    return Planar(pose if head.frame == frames.base else _moved(frames.mentor_pose, pose), height)


def heading(orientation: tuple[float, float, float, float]) -> float:
    """Where the x axis of a rotation points in the plane, rad, counter-clockwise.

    Raises:
        RefusedError: not finite, not of length 1, or the axis stands upright.
    """
    if not all(map(math.isfinite, orientation)):
        raise RefusedError(
            'not finite',
            f'Expected an orientation of finite numbers, got {_written(orientation)}.',
        )
    length = math.hypot(*orientation)
    if abs(length - 1) > LENGTH_TOLERANCE:
        raise RefusedError(
            'quaternion',
            f'Expected a quaternion of length 1 within {LENGTH_TOLERANCE:g}, got {length:.4g}.',
        )
    x, y, z, w = (part / length for part in orientation)
    forward, left = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z)
    if math.hypot(forward, left) < LEAST_LEVEL:
        raise RefusedError(
            'no heading',
            'Expected a head that looks level enough to have a heading, got one that looks '
            'straight up or down.',
        )
    return math.atan2(left, forward)


def in_cm(pose: Sequence[float]) -> Pose2:
    """x m, y m, heading rad as a pose of the gaze model."""
    x, y, turn = pose
    return Pose2(x * CM_PER_M, y * CM_PER_M, turn)


def in_m(pose: Pose2) -> Pose2:
    """A pose of the gaze model with its place in m."""
    return Pose2(pose.x / CM_PER_M, pose.y / CM_PER_M, pose.heading)


def belief_in_m(belief: Gaussian) -> Gaussian:
    """A belief about a place, cm, in m."""
    covariance: FloatArray = belief.covariance / CM_PER_M**2
    return Gaussian(belief.mean / CM_PER_M, covariance)


def _moved(frame: Pose2, pose: Pose2) -> Pose2:
    """A pose of a frame in the frame's parent."""
    x, y = frame.to_parent((pose.x, pose.y))
    return Pose2(float(x), float(y), pose.heading + frame.heading)


def _written(values: tuple[float, ...]) -> str:
    return f'({", ".join(f"{value:g}" for value in values)})'
