"""Between ROS messages and the values of a watched mentor."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

import numpy as np
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point, PoseStamped, PoseWithCovarianceStamped, Vector3
from std_msgs.msg import ColorRGBA, Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

from likeme_core.ros.time import stamp_ns, time_msg
from likeme_gaze import Gaussian, Pose2
from likeme_gaze.checks import FloatArray
from likeme_gaze.mentor.head_pose import HeadPose
from likeme_gaze.mentor.watch import Answer

#: Variance of what the model does not speak of: z, and the goal's orientation.
UNKNOWN = 1e6
#: 95 % of a Gaussian in the plane lies within this many standard deviations: sqrt(-2 log 0.05).
RADIUS_95 = float(np.sqrt(-2 * np.log(0.05)))
#: Length of the lines of sight that end nowhere, m.
RAY = 1.0

BLUE, RED, GREY = (0.1, 0.35, 0.9), (0.85, 0.1, 0.1), (0.55, 0.55, 0.55)


def head_pose(msg: PoseStamped, now: int) -> HeadPose:
    """Read a head pose; a stamp of 0 is taken for `now` (ns), the time of arrival."""
    place, turn = msg.pose.position, msg.pose.orientation
    return HeadPose(
        stamp_ns(msg.header.stamp) or now,
        msg.header.frame_id,
        (place.x, place.y, place.z),
        (turn.x, turn.y, turn.z, turn.w),
    )


def goal_msg(answer: Answer, frame: str) -> PoseWithCovarianceStamped:
    """Message of the goal: x, y and their covariance; z at the height of the mentor's eyes."""
    assert answer.goal is not None, 'Only observations say something about a goal.'
    msg = PoseWithCovarianceStamped(header=_header(answer, frame))
    msg.pose.pose.position = _point(answer.goal.mean, answer.height)
    covariance = np.diag([0.0, 0.0, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN])
    covariance[:2, :2] = answer.goal.covariance
    msg.pose.covariance = covariance.ravel().tolist()
    return msg


def command_msg(answer: Answer, frame: str, joint: str, turn_time: float) -> JointTrajectory:
    """Command that turns the neck to the mean of the inferred action within s."""
    seconds, rest = divmod(round(turn_time * 1e9), 1_000_000_000)
    point = JointTrajectoryPoint(
        positions=[answer.neck[0]], time_from_start=Duration(sec=seconds, nanosec=rest)
    )
    return JointTrajectory(header=_header(answer, frame), joint_names=[joint], points=[point])


def markers_msg(answer: Answer, frame: str) -> MarkerArray:
    """What to draw: lines of sight of mentor and robot, the goal and its 95 % ellipse."""
    header = _header(answer, frame)
    markers = [Marker(header=header, action=Marker.DELETEALL)]
    markers.append(_arrow(header, 'mentor start', answer, answer.mentor_start, RAY, GREY))
    if answer.goal is None:
        return MarkerArray(
            markers=[*markers, _arrow(header, 'robot', answer, answer.robot, RAY, GREY)]
        )
    mean = answer.goal.mean
    markers += [
        _arrow(header, 'mentor', answer, answer.mentor, _distance(answer.mentor, mean), BLUE),
        _arrow(header, 'robot', answer, answer.robot, _distance(answer.robot, mean), RED),
        _sphere(header, answer.goal, answer.height),
        _ellipse(header, answer.goal, answer.height),
    ]
    return MarkerArray(markers=markers)


def ellipse_95(goal: Gaussian, corners: int = 64) -> FloatArray:
    """The border of the 95 % region of a belief in the plane, closed (corners + 1, 2)."""
    angle = np.linspace(0.0, 2 * np.pi, corners + 1)
    circle = RADIUS_95 * np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray(goal.mean + (np.linalg.cholesky(goal.covariance) @ circle).T)


def _header(answer: Answer, frame: str) -> Header:
    return Header(stamp=time_msg(answer.stamp), frame_id=frame)


def _point(place: Sequence[float] | FloatArray, height: float) -> Point:
    return Point(x=float(place[0]), y=float(place[1]), z=float(height))


def _colour(rgb: tuple[float, float, float], alpha: float = 1.0) -> ColorRGBA:
    return ColorRGBA(r=rgb[0], g=rgb[1], b=rgb[2], a=alpha)


def _distance(head: Pose2, place: FloatArray) -> float:
    return float(np.hypot(place[0] - head.x, place[1] - head.y))


def _arrow(
    header: Header,
    name: str,
    answer: Answer,
    head: Pose2,
    length: float,
    colour: tuple[float, float, float],
) -> Marker:
    """A line of sight, drawn at the height of the mentor's eyes."""
    end = (head.x + length * cos(head.heading), head.y + length * sin(head.heading))
    arrow = Marker(header=header, ns=name, type=Marker.ARROW, color=_colour(colour, 0.8))
    arrow.points = [_point((head.x, head.y), answer.height), _point(end, answer.height)]
    # Diameters of shaft and head, and the head's length.
    arrow.scale = Vector3(x=0.03, y=0.1, z=0.15)
    return arrow


def _sphere(header: Header, goal: Gaussian, height: float) -> Marker:
    sphere = Marker(header=header, ns='goal', type=Marker.SPHERE, color=_colour(RED))
    sphere.pose.position = _point(goal.mean, height)
    sphere.scale = Vector3(x=0.12, y=0.12, z=0.12)
    return sphere


def _ellipse(header: Header, goal: Gaussian, height: float) -> Marker:
    line = Marker(header=header, ns='goal 95 %', type=Marker.LINE_STRIP, color=_colour(RED))
    line.points = [_point(corner, height) for corner in ellipse_95(goal)]
    line.scale.x = 0.02
    return line
