"""Between ROS messages and a watched mentor: units, frames, stamps, covariances, markers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mentors import head, message
from visualization_msgs.msg import Marker

from likeme_core.ros.parameters import descriptor as descriptor_of
from likeme_gaze import Gaussian, Pose2
from likeme_gaze.beliefs import mahalanobis
from likeme_gaze.mentor import messages
from likeme_gaze.mentor.settings import SETTINGS
from likeme_gaze.mentor.watch import Answer

GOAL = Gaussian(np.array([3.0, 2.5]), np.array([[1.2, -0.8], [-0.8, 0.7]]))
ANSWER = Answer(
    stamp=105_500_000_000,
    height=1.2,
    observations=5,
    mentor_start=Pose2(6.0, 0.0, math.pi),
    mentor=Pose2(6.0, 0.0, 0.75 * math.pi),
    robot=Pose2(0.0, 0.0, 0.7),
    goal=GOAL,
    neck=(0.69, 0.1),
    turn=True,
)


def test_a_head_pose_is_read_as_it_was_sent() -> None:
    pose = head(12.25, 0.4, (1.0, -2.0, 1.5), 'mentor')
    assert messages.head_pose(message(pose), now=7) == pose


def test_a_stamp_of_zero_is_the_time_of_arrival() -> None:
    assert messages.head_pose(message(head(0)), now=7).stamp == 7


def test_a_goal_has_its_covariance_and_admits_what_it_does_not_know() -> None:
    msg = messages.goal_msg(ANSWER, 'base_link')
    place = msg.pose.pose.position
    assert (place.x, place.y, place.z) == (3.0, 2.5, 1.2)
    assert (msg.header.frame_id, msg.header.stamp.sec) == ('base_link', 105)
    assert msg.header.stamp.nanosec == 500_000_000
    assert msg.pose.pose.orientation.w == 1.0
    covariance = np.reshape(msg.pose.covariance, (6, 6))
    np.testing.assert_array_equal(covariance[:2, :2], GOAL.covariance)
    np.testing.assert_array_equal(np.diag(covariance)[2:], [1e6] * 4)
    assert np.count_nonzero(covariance) == 8


def test_a_command_is_one_point_of_one_joint() -> None:
    msg = messages.command_msg(ANSWER, 'base_link', 'neck', 1.5)
    (point,) = msg.points
    assert (list(msg.joint_names), list(point.positions)) == (['neck'], [0.69])
    assert (point.time_from_start.sec, point.time_from_start.nanosec) == (1, 500_000_000)


def test_markers_show_lines_of_sight_the_goal_and_its_region() -> None:
    first, *drawn = messages.markers_msg(ANSWER, 'base_link').markers
    assert first.action == Marker.DELETEALL
    by_name = {marker.ns: marker for marker in drawn}
    assert set(by_name) == {'mentor start', 'mentor', 'robot', 'goal', 'goal 95 %'}
    assert all(m.color.a > 0 and m.scale.x > 0 for m in drawn)
    tail, tip = by_name['mentor'].points
    assert (tail.x, tail.y, tail.z) == (6.0, 0.0, 1.2)
    assert math.atan2(tip.y - tail.y, tip.x - tail.x) == pytest.approx(0.75 * math.pi)
    assert math.hypot(tip.y - tail.y, tip.x - tail.x) == pytest.approx(math.hypot(3.0, 2.5))
    corners = np.array([(p.x, p.y) for p in by_name['goal 95 %'].points])
    # The 95 % quantile of chi-squared with two degrees of freedom.
    np.testing.assert_allclose([mahalanobis(GOAL, c) for c in corners], 5.991464547, rtol=1e-6)
    np.testing.assert_allclose(corners[0], corners[-1], atol=1e-9)


def test_before_anything_was_observed_there_is_no_goal_to_draw() -> None:
    drawn = messages.markers_msg(ANSWER._replace(goal=None, turn=False), 'base_link').markers
    assert [marker.ns for marker in drawn] == ['', 'mentor start', 'robot']


def test_every_parameter_is_described_and_within_its_range() -> None:
    for parameter in SETTINGS.values():
        descriptor = descriptor_of(parameter)
        assert descriptor.description
        ranges = [*descriptor.integer_range, *descriptor.floating_point_range]
        assert all(r.from_value <= parameter.default <= r.to_value for r in ranges)
