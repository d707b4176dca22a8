"""Gaze following of one mentor: frames, rejected inputs, a new start pose."""

from __future__ import annotations

import math

import numpy as np
import pytest

from likeme_gaze import (
    Experience,
    Gaussian,
    GazeFollower,
    GazeModel,
    Pose2,
    blindfolded_experience,
    self_experience,
)

AGENT, MENTOR = Pose2(0.0, 0.0, 0.0), Pose2(600.0, 0.0, math.pi)
#: The mentor's turn to its left: a target at (300, -300), as far from the agent.
LEFT = Pose2(600.0, 0.0, math.pi + math.pi / 4)
AWAY = 300 * math.sqrt(2)


@pytest.fixture(scope='module')
def model() -> GazeModel:
    rng = np.random.default_rng(12)
    return GazeModel.learned(self_experience(rng, 100), blindfolded_experience(rng, 60))


@pytest.fixture
def follower(model: GazeModel) -> GazeFollower:
    follower = GazeFollower(model, AGENT)
    follower.start(MENTOR)
    return follower


def test_gaze_is_followed(follower: GazeFollower) -> None:
    for seen in range(1, 6):
        following = follower.observe(LEFT, AWAY)
        assert follower.observations == seen
        assert follower.following is following
    assert following.goal.mean == pytest.approx([300, -300], abs=40)
    assert math.degrees(following.action.mean[0]) == pytest.approx(-45, abs=5)
    assert math.degrees(following.final.mean[0]) == pytest.approx(-45, abs=5)
    assert following.final.mean[1] == pytest.approx(AWAY, abs=40)


def test_without_distances(follower: GazeFollower) -> None:
    following = follower.observe(LEFT)
    x, y = following.goal.mean
    assert math.atan2(-y, 600 - x) == pytest.approx(math.pi / 4, abs=0.15)
    assert np.sqrt(np.linalg.eigvalsh(following.goal.covariance)[1]) > 100


def test_results_do_not_depend_on_the_parent_frame(model: GazeModel) -> None:
    here = GazeFollower(model, AGENT, agent_heading=0.3)
    here.start(MENTOR)
    world = Pose2(-250.0, 70.0, 2.5)

    def moved(pose: Pose2) -> Pose2:
        x, y = world.to_parent([pose.x, pose.y])
        return Pose2(float(x), float(y), pose.heading + world.heading)

    there = GazeFollower(model, moved(AGENT), agent_heading=0.3)
    there.start(moved(MENTOR))
    one, other = here.observe(LEFT, AWAY), there.observe(moved(LEFT), AWAY)
    assert other.goal.mean == pytest.approx(one.goal.mean, rel=1e-6)
    assert other.goal.covariance == pytest.approx(one.goal.covariance, rel=1e-6, abs=1e-3)
    assert other.action.mean == pytest.approx(one.action.mean, rel=1e-6)


def test_headings_are_modulo_a_full_turn(follower: GazeFollower, model: GazeModel) -> None:
    plain = follower.observe(LEFT, AWAY)
    again = GazeFollower(model, AGENT)
    again.start(MENTOR._replace(heading=-math.pi))
    wound = again.observe(LEFT._replace(heading=LEFT.heading - 6 * math.pi), AWAY)
    assert wound.goal.mean == pytest.approx(plain.goal.mean, rel=1e-9)


def test_a_blindfolded_mentor_is_not_followed(model: GazeModel) -> None:
    follower = GazeFollower(model, AGENT)
    follower.start(MENTOR, blindfolded=True)
    for _ in range(5):
        following = follower.observe(LEFT, AWAY)
    assert abs(math.degrees(following.action.mean[0])) < 15


def test_an_agent_without_blindfold_experience_follows() -> None:
    follower = GazeFollower(GazeModel.simulated(2, points=60), AGENT)
    follower.start(MENTOR, blindfolded=True)
    assert math.degrees(follower.observe(LEFT, AWAY).action.mean[0]) < -30


def test_a_new_start_pose_resets_the_follower(follower: GazeFollower) -> None:
    first = follower.observe(LEFT, AWAY)
    follower.observe(LEFT, AWAY)
    follower.start(MENTOR)
    assert (follower.observations, follower.following) == (0, None)
    assert follower.observe(LEFT, AWAY).goal.mean == pytest.approx(first.goal.mean, rel=1e-12)


def test_given_prior(model: GazeModel) -> None:
    prior = Gaussian(np.array([250.0, -250.0]), 4.0 * np.eye(2))
    follower = GazeFollower(model, AGENT, prior=prior)
    follower.start(MENTOR)
    assert follower.observe(LEFT, AWAY).goal.mean == pytest.approx([250, -250], abs=5)


@pytest.mark.parametrize(
    ('pose', 'distance', 'sentence'),
    [
        (Pose2(600, 0, math.nan), AWAY, r"the mentor's pose to be x, y and heading.*nan"),
        (Pose2(math.inf, 0, 3), AWAY, 'all finite'),
        (Pose2(660, 0, 3), AWAY, 'within 30 cm of its start place, got 60.0 cm'),
        (LEFT, -1.0, 'a distance of more than 0 cm, got -1'),
        (LEFT, math.nan, 'a distance of more than 0 cm, got nan'),
        (LEFT, None, 'Expected a distance as before, got None'),
    ],
)
def test_rejected_inputs_change_nothing(
    follower: GazeFollower, pose: Pose2, distance: float | None, sentence: str
) -> None:
    before = follower.observe(LEFT, AWAY)
    with pytest.raises(ValueError, match=sentence):
        follower.observe(pose, distance)
    assert follower.observations == 1
    assert follower.following is before


def test_a_missing_start_pose_and_a_mentor_at_the_agent_are_rejected(model: GazeModel) -> None:
    follower = GazeFollower(model, AGENT)
    with pytest.raises(ValueError, match='Expected a start pose before the first observation'):
        follower.observe(LEFT, AWAY)
    with pytest.raises(ValueError, match='at least 10 cm from the agent, got 5'):
        follower.start(Pose2(3.0, 4.0, 0.0))
    assert follower.mentor is None
    with pytest.raises(ValueError, match="the agent's pose"):
        GazeFollower(model, Pose2(0.0, math.nan, 0.0))
    with pytest.raises(ValueError, match='the mean of the prior'):
        GazeFollower(model, AGENT, prior=Gaussian(np.zeros(3), np.eye(3)))


def test_invalid_experience_is_rejected() -> None:
    seen = self_experience(np.random.default_rng(0), 20)
    with pytest.raises(ValueError, match=r'start of shape \(20,\), got \(19,\)'):
        GazeModel.learned(Experience(seen.goal, seen.start[:19], seen.action, seen.final))
    with pytest.raises(ValueError, match='at least 5 training points, got 4'):
        GazeModel.simulated(1, points=4)
