"""Head poses for tests, as values and as messages."""

from __future__ import annotations

import math

from geometry_msgs.msg import PoseStamped

from likeme_core.ros.time import time_msg
from likeme_gaze.mentor.head_pose import HeadPose
from likeme_gaze.mentor.settings import SETTINGS, GazeSettings, read_settings

SECOND = 1_000_000_000
#: The mentor 6 m ahead of the robot looks at it, or 45 degrees to its right: the robot's left.
TO_ROBOT, TO_LEFT, TO_RIGHT = math.pi, 0.75 * math.pi, -0.75 * math.pi


def settings(**changes: object) -> GazeSettings:
    """The node's defaults with changes."""
    return read_settings({n: p.default for n, p in SETTINGS.items()} | changes)


def yaw(angle: float) -> tuple[float, float, float, float]:
    """A turn about z as a quaternion."""
    return (0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2))


def head(
    seconds: float,
    angle: float = TO_ROBOT,
    place: tuple[float, float, float] = (6.0, 0.0, 1.2),
    frame: str = 'base_link',
    orientation: tuple[float, float, float, float] | None = None,
) -> HeadPose:
    """A head pose at a time."""
    return HeadPose(round(seconds * SECOND), frame, place, orientation or yaw(angle))


def message(pose: HeadPose) -> PoseStamped:
    """The same as a message."""
    msg = PoseStamped()
    msg.header.stamp, msg.header.frame_id = time_msg(pose.stamp), pose.frame
    place, turn = msg.pose.position, msg.pose.orientation
    # rclpy reads an int as if its memory held a double.
    place.x, place.y, place.z = map(float, pose.position)
    turn.x, turn.y, turn.z, turn.w = map(float, pose.orientation)
    return msg
