"""Projection of head poses (3D, m) to the plane of the gaze model (cm, robot's frame)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from likeme_gaze import Gaussian, Pose2
from likeme_gaze.checks import FloatArray
from likeme_gaze.mentor.rejections import RejectedInputError

#: The gaze model uses cm.
CM_PER_M = 100.0
#: Largest coordinate or distance that is accepted, m; far greater ones overflow in the model.
MAX_POSITION = 1e4
#: Largest deviation of a quaternion's norm from 1 that is normalised; beyond it, it is rejected.
NORM_TOLERANCE = 0.01
#: Least horizontal part of a unit line of sight for a defined heading (84 degrees up or down).
MIN_HORIZONTAL = 0.1


class HeadPose(NamedTuple):
    """A head pose in 3D.

    Attributes:
        stamp: ns.
        frame: frame_id of position and orientation; x forward, y left, z up.
        position: x, y, z in m.
        orientation: quaternion x, y, z, w; the line of sight is the x axis.
    """

    stamp: int
    frame: str
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]


class Frames(NamedTuple):
    """The frames that head poses may be given in.

    Attributes:
        base: frame_id of the robot.
        mentor: frame_id of the mentor.
        mentor_pose: pose of the mentor's frame in the robot's, cm and rad.
    """

    base: str
    mentor: str
    mentor_pose: Pose2


class PlanarHead(NamedTuple):
    """A head pose in the plane.

    Attributes:
        pose: in the robot's frame, cm and rad.
        height: of the eyes, m.
    """

    pose: Pose2
    height: float


def project_to_plane(head: HeadPose, frames: Frames) -> PlanarHead:
    """The head pose in the plane of the gaze model.

    Raises:
        RejectedInputError: an unknown frame, values out of range, a quaternion that is not
            of unit norm, or a line of sight straight up or down.
    """
    if head.frame not in (frames.base, frames.mentor):
        raise RejectedInputError(
            'unknown frame',
            f'Expected a head pose in {frames.base} or {frames.mentor}, got {head.frame!r}.',
        )
    if not all(map(math.isfinite, head.position)):
        raise RejectedInputError(
            'not finite', f'Expected a position of finite numbers, got {_written(head.position)}.'
        )
    if max(map(abs, head.position)) > MAX_POSITION:
        raise RejectedInputError(
            'position',
            f'Expected a position within {MAX_POSITION:g} m, got {_written(head.position)}.',
        )
    x, y, height = head.position
    pose = Pose2(x * CM_PER_M, y * CM_PER_M, heading(head.orientation))
    return PlanarHead(
        pose if head.frame == frames.base else _to_parent(frames.mentor_pose, pose), height
    )


def heading(orientation: tuple[float, float, float, float]) -> float:
    """Heading of a rotation's x axis in the plane, rad, counter-clockwise.

    Raises:
        RejectedInputError: not finite, not of unit norm, or a vertical x axis.
    """
    if not all(map(math.isfinite, orientation)):
        raise RejectedInputError(
            'not finite',
            f'Expected an orientation of finite numbers, got {_written(orientation)}.',
        )
    length = math.hypot(*orientation)
    if abs(length - 1) > NORM_TOLERANCE:
        raise RejectedInputError(
            'quaternion',
            f'Expected a quaternion of norm 1 within {NORM_TOLERANCE:g}, got {length:.4g}.',
        )
    x, y, z, w = (part / length for part in orientation)
    forward, left = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z)
    if math.hypot(forward, left) < MIN_HORIZONTAL:
        raise RejectedInputError(
            'no heading',
            'Expected a line of sight with a heading, got one that points straight up or down.',
        )
    return math.atan2(left, forward)


def in_cm(pose: Sequence[float]) -> Pose2:
    """x, y in m and heading in rad as a pose of the gaze model."""
    x, y, turn = pose
    return Pose2(x * CM_PER_M, y * CM_PER_M, turn)


def in_m(pose: Pose2) -> Pose2:
    """A pose of the gaze model with its position in m."""
    return Pose2(pose.x / CM_PER_M, pose.y / CM_PER_M, pose.heading)


def belief_in_m(belief: Gaussian) -> Gaussian:
    """A belief about a position, converted from cm to m."""
    covariance: FloatArray = belief.covariance / CM_PER_M**2
    return Gaussian(belief.mean / CM_PER_M, covariance)


def _to_parent(frame: Pose2, pose: Pose2) -> Pose2:
    """A pose given in a frame, in the parent of that frame."""
    x, y = frame.to_parent((pose.x, pose.y))
    return Pose2(float(x), float(y), pose.heading + frame.heading)


def _written(values: tuple[float, ...]) -> str:
    return f'({", ".join(f"{value:g}" for value in values)})'
