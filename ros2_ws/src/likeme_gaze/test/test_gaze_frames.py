"""Frames of agent and mentor: points and beliefs there and back."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from likeme_gaze import Gaussian, Pose2, goal_prior
from likeme_gaze.frames import checked_pose, wrapped

lengths, angles = st.floats(-1e3, 1e3), st.floats(-10, 10)
poses = st.builds(Pose2, lengths, lengths, angles)
points = st.tuples(lengths, lengths).map(np.array)
roots = st.lists(st.floats(-30, 30), min_size=4, max_size=4).map(lambda v: np.reshape(v, (2, 2)))


@settings(max_examples=50, deadline=None, derandomize=True)
@given(poses, points, roots)
def test_round_trip(pose: Pose2, point: np.ndarray, root: np.ndarray) -> None:
    belief = Gaussian(point, root @ root.T)
    there = pose.belief_to_parent(belief)
    back = pose.belief_from_parent(there)
    assert back.mean == pytest.approx(belief.mean, abs=1e-9)
    assert back.covariance == pytest.approx(belief.covariance, abs=1e-9)
    assert there.mean == pytest.approx(pose.to_parent(point))
    assert np.linalg.eigvalsh(there.covariance) == pytest.approx(
        np.linalg.eigvalsh(belief.covariance), abs=1e-9
    )


def test_a_mentor_that_faces_the_agent() -> None:
    mentor = Pose2(600.0, 0.0, math.pi)
    assert mentor.to_parent([200.0, 100.0]) == pytest.approx([400.0, -100.0])
    assert mentor.from_parent([400.0, -100.0]) == pytest.approx([200.0, 100.0])
    assert Pose2(600.0, 0.0, 1.0).facing(0.0, 0.0).heading == pytest.approx(math.pi)


def test_beliefs_rotate_with_their_frame() -> None:
    belief = Gaussian(np.array([100.0, 0.0]), np.diag([4.0, 1.0]))
    turned = Pose2(0.0, 0.0, math.pi / 2).belief_to_parent(belief)
    assert turned.mean == pytest.approx([0.0, 100.0])
    assert turned.covariance == pytest.approx(np.diag([1.0, 4.0]))


def test_a_batch_of_beliefs() -> None:
    belief = Gaussian(np.zeros((7, 2)), np.broadcast_to(np.diag([4.0, 1.0]), (7, 2, 2)))
    turned = Pose2(1.0, 2.0, 0.3).belief_to_parent(belief)
    assert turned.mean.shape == (7, 2)
    assert turned.covariance.shape == (7, 2, 2)


def test_the_prior_lies_halfway_along_the_line_of_the_two() -> None:
    ahead = goal_prior(Pose2(0.0, 0.0, 0.0), Pose2(600.0, 0.0, math.pi))
    assert ahead.mean == pytest.approx([300.0, 0.0])
    assert ahead.covariance == pytest.approx(np.diag([80_000.0, 20_000.0]))
    aside = goal_prior(Pose2(0.0, 0.0, 0.0), Pose2(0.0, 600.0, 0.0))
    assert aside.covariance == pytest.approx(np.diag([20_000.0, 80_000.0]), abs=1e-6)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.floats(-50, 50))
def test_wrapped(angle: float) -> None:
    assert -math.pi <= wrapped(angle) < math.pi
    assert math.cos(float(wrapped(angle)) - angle) == pytest.approx(1.0)


def test_invalid_poses_are_rejected() -> None:
    with pytest.raises(ValueError, match=r'Expected it to be x, y and heading.*\(0, nan, 1\)'):
        checked_pose('it', Pose2(0.0, math.nan, 1.0))
