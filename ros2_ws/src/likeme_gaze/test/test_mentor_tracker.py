"""The mentor tracker without ROS: frames, units, rejected inputs, stamps, distances, settings."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from head_poses import TO_LEFT, TO_RIGHT, TO_ROBOT, head, settings, yaw
from hypothesis import given
from hypothesis import strategies as st

from likeme_gaze import Gaussian, GazeFollower, GazeModel, Pose2
from likeme_gaze.mentor.head_pose import Frames, heading, project_to_plane
from likeme_gaze.mentor.mentor_tracker import GazeEstimate, MentorTracker
from likeme_gaze.mentor.rejections import RejectedInputError, RejectionCounter

FRAMES = Frames('base_link', 'mentor', Pose2(600.0, 0.0, math.pi))
angles = st.floats(-3.1, 3.1)


@cache
def model(points: int = 60) -> GazeModel:
    return settings(training_points=points).learning.model()


def new_tracker(**changes: Any) -> MentorTracker:
    return MentorTracker(model(), settings(**changes).tracking)


def run_trial(
    tracker: MentorTracker, angle: float, begin: float = 100.0, **more: Any
) -> list[GazeEstimate]:
    """Run one trial; its estimates."""
    tracker.start(head(begin, **more))
    seen = range(1, tracker.settings.observations + 1)
    estimates = [tracker.observe(head(begin + k, angle, **more)) for k in seen]
    return [estimate for estimate in estimates if estimate is not None]


@given(angles, st.floats(-0.7, 0.7), st.floats(-1.0, 1.0))
def test_heading_is_the_yaw_for_any_pitch_and_roll(turn: float, pitch: float, roll: float) -> None:
    (cz, cy, cx), (sz, sy, sx) = (
        [f(a / 2) for a in (turn, pitch, roll)] for f in (math.cos, math.sin)
    )
    quaternion = (
        sx * cy * cz - cx * sy * sz,
        cx * sy * cz + sx * cy * sz,
        cx * cy * sz - sx * sy * cz,
        cx * cy * cz + sx * sy * sz,
    )
    assert heading(quaternion) == pytest.approx(turn, abs=1e-9)


@given(st.floats(-5, 5), st.floats(-5, 5), angles)
def test_poses_in_the_mentor_frame_are_transformed_to_the_robot_frame(
    x: float, y: float, turn: float
) -> None:
    seen = project_to_plane(head(1, turn, (x, y, 1.5), 'mentor'), FRAMES)
    assert seen.height == 1.5
    assert (seen.pose.x, seen.pose.y) == pytest.approx((600 - 100 * x, -100 * y))
    assert math.cos(seen.pose.heading - turn - math.pi) == pytest.approx(1.0)


def test_a_quaternion_is_normalised_within_the_tolerance() -> None:
    nearly = tuple(0.995 * part for part in yaw(0.3))
    assert heading(nearly) == pytest.approx(0.3)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ('pose', 'reason', 'why'),
    [
        (head(1, frame='map'), 'unknown frame', "in base_link or mentor, got 'map'"),
        (head(1, frame=''), 'unknown frame', "got ''"),
        (head(1, place=(math.nan, 0, 0)), 'not finite', 'got (nan, 0, 0)'),
        (head(1, place=(0, math.inf, 0)), 'not finite', 'got (0, inf, 0)'),
        (head(1, place=(0, 1e150, 0)), 'position', 'within 10000 m, got (0, 1e+150, 0)'),
        (head(1, orientation=(0, 0, math.nan, 1)), 'not finite', 'got (0, 0, nan, 1)'),
        (head(1, orientation=(0, 0, 0, 0)), 'quaternion', 'of norm 1 within 0.01, got 0.'),
        (head(1, orientation=(0, 0, 0.6, 0.9)), 'quaternion', 'got 1.082.'),
        (head(1, orientation=(0, 0.5**0.5, 0, 0.5**0.5)), 'no heading', 'straight up or down'),
    ],
)
def test_invalid_head_poses_are_rejected(pose: Any, reason: str, why: str) -> None:
    with pytest.raises(RejectedInputError) as refused:
        project_to_plane(pose, FRAMES)
    assert refused.value.reason == reason
    assert why in str(refused.value)


@pytest.mark.parametrize(('angle', 'side'), [(TO_LEFT, 1), (TO_RIGHT, -1)])
def test_estimates_equal_those_of_the_follower(angle: float, side: int) -> None:
    estimates = run_trial(new_tracker(), angle)
    wide = Gaussian(np.array([300.0, 0.0]), np.diag([115.0**2, 289.0**2]))
    follower = GazeFollower(model(), Pose2(0, 0, 0), prior=wide)
    follower.start(Pose2(600, 0, TO_ROBOT))
    expected = [follower.observe(Pose2(600, 0, angle)) for _ in estimates][-1]
    last = estimates[-1]
    assert last.goal is not None
    np.testing.assert_allclose(last.goal.mean * 100, expected.goal.mean, atol=1e-6)
    np.testing.assert_allclose(last.goal.covariance * 1e4, expected.goal.covariance, atol=1e-4)
    assert last.neck[0] == pytest.approx(expected.action.mean[0])
    assert side * math.degrees(last.neck[0]) > 30
    assert [estimate.turn for estimate in estimates] == [False] * 4 + [True]
    assert (last.height, last.observations, last.stamp) == (1.2, 5, 105 * 10**9)


def test_estimates_do_not_depend_on_the_frames() -> None:
    base = run_trial(new_tracker(), TO_LEFT)[-1]
    own = new_tracker()
    own.start(head(100, 0.0, (0, 0, 1.2), 'mentor'))
    in_own = [own.observe(head(101 + k, -math.pi / 4, (0, 0, 1.2), 'mentor')) for k in range(5)]
    # All turned by 90 degrees and moved by (1, 2) m.
    moved = new_tracker(robot_head=[1.0, 2.0, math.pi / 2])
    place = (1.0, 8.0, 1.2)
    moved.start(head(100, TO_ROBOT + math.pi / 2, place))
    turned = [moved.observe(head(101 + k, TO_LEFT + math.pi / 2, place)) for k in range(5)]
    assert base.goal is not None
    for estimate, goal in (
        (in_own[-1], base.goal.mean),
        (turned[-1], (1, 2) + base.goal.mean[::-1] * (-1, 1)),
    ):
        assert estimate is not None
        assert estimate.goal is not None
        np.testing.assert_allclose(estimate.goal.mean, goal, atol=1e-6)
        assert estimate.neck[0] == pytest.approx(base.neck[0], abs=1e-6)


def rejected_as(reason: str, act: Callable[[], object]) -> str:
    with pytest.raises(RejectedInputError) as refused:
        act()
    assert refused.value.reason == reason
    return str(refused.value)


def test_observations_need_a_start_pose_and_are_limited() -> None:
    tracker = new_tracker(observations=2)
    message = rejected_as('no start pose', lambda: tracker.observe(head(1)))
    assert 'got none' in message
    run_trial(tracker, TO_LEFT)
    message = rejected_as('enough seen', lambda: tracker.observe(head(103)))
    assert message == 'Expected 2 head poses after a start pose, got one more.'


def test_stamps_must_increase() -> None:
    tracker = new_tracker()
    tracker.start(head(100))
    tracker.observe(head(101, TO_LEFT))
    message = rejected_as('stamp', lambda: tracker.observe(head(101, TO_LEFT)))
    assert message.endswith('101.000 s, got 101.000 s.')
    rejected_as('stamp', lambda: tracker.observe(head(99, TO_LEFT)))
    assert tracker.observations == 1
    rejected_as('stamp', lambda: tracker.start(head(100.5)))
    assert tracker.observations == 1


def test_a_repeated_recording_is_accepted() -> None:
    tracker = new_tracker()
    run_trial(tracker, TO_LEFT)
    rejected_as('stamp', lambda: tracker.start(head(10)))
    assert len(run_trial(tracker, TO_LEFT, 20)) == 5


def test_an_invalid_start_pose_ends_the_trial_before() -> None:
    tracker = new_tracker()
    tracker.start(head(100))
    rejected_as('not finite', lambda: tracker.start(head(101, place=(math.nan, 0, 0))))
    rejected_as('no start pose', lambda: tracker.observe(head(102)))
    with pytest.raises(ValueError, match='at least 10 cm from the agent'):
        tracker.start(head(103, place=(0.05, 0, 1)))
    rejected_as('no start pose', lambda: tracker.observe(head(104)))


@pytest.mark.parametrize('place', [(6.5, 0.0, 1.2), (1e4, 0.0, 1.2)])
def test_a_pose_far_from_the_start_pose_is_rejected(place: tuple[float, float, float]) -> None:
    tracker = new_tracker()
    tracker.start(head(100))
    before = tracker.observe(head(101, TO_LEFT))
    with pytest.raises(ValueError, match='within 30 cm of its start place'):
        tracker.observe(head(102, TO_LEFT, place))
    after = tracker.observe(head(102, TO_LEFT))
    assert before is not None
    assert after is not None
    assert after.observations == 2


def test_distances_and_head_poses_match_in_either_order() -> None:
    tracker = new_tracker(use_distance=True, observations=3)
    tracker.start(head(100))
    assert tracker.observe(head(101, TO_LEFT)) is None
    first = tracker.observe_distance(101 * 10**9, 4.24)
    assert tracker.observe_distance(102 * 10**9, 4.24) is None
    second = tracker.observe(head(102, TO_LEFT))
    assert tracker.observe_distance(999, 4.0) is None
    rejected_as('distance', lambda: tracker.observe_distance(103 * 10**9, -1.0))
    for distance in (math.nan, math.inf, 1e100):
        rejected_as('distance', lambda d=distance: tracker.observe_distance(103 * 10**9, d))
    assert first is not None
    assert second is not None
    assert (first.observations, second.observations) == (1, 2)
    assert second.goal is not None
    np.testing.assert_allclose(second.goal.mean, (3.0, 3.0), atol=0.3)
    for k in range(10):
        assert tracker.observe(head(110 + k, TO_LEFT)) is None
    message = rejected_as('no distance', lambda: tracker.observe(head(120, TO_LEFT)))
    assert 'got none for 11 of them' in message


@pytest.mark.parametrize(
    ('change', 'why'),
    [
        ({'blindfold_experience': 'wool'}, "none, windowed, opaque, got 'wool'"),
        ({'prior_std': [1.0, 0.0]}, 'Expected prior_std of more than 0 m, got 0.'),
        ({'prior_std': [1.0]}, 'Expected prior_std as 2 finite numbers, got [1.0].'),
        ({'mentor_pose': [1, 2, math.nan]}, 'Expected mentor_pose as 3 finite numbers'),
        ({'robot_head': [1e200, 0.0, 0.0]}, 'Expected robot_head within +-10000, got [1e+200'),
        ({'robot_head': None}, 'Expected robot_head as 3 finite numbers, got [None].'),
        ({'mentor_frame': 'base_link'}, "got 'base_link' twice"),
        ({'head_joint': ''}, 'Expected a name as head_joint, got an empty string.'),
    ],
)
def test_invalid_settings_are_rejected(change: dict[str, Any], why: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        settings(**change)
    assert why in str(refused.value)


def test_too_few_training_points_are_refused() -> None:
    with pytest.raises(ValueError, match='at least 5 training points, got 3'):
        settings(training_points=3).learning.model()


@pytest.mark.parametrize(
    ('experience', 'follows'), [('none', True), ('windowed', True), ('opaque', False)]
)
def test_opaque_blindfold_experience_prevents_following(experience: str, follows: bool) -> None:
    chosen = settings(training_points=60, blindfold_experience=experience, mentor_blindfolded=True)
    tracker = MentorTracker(chosen.learning.model(), chosen.tracking)
    turns = [
        math.degrees(run_trial(tracker, a, b)[-1].neck[0])
        for a, b in ((TO_LEFT, 100), (TO_RIGHT, 200))
    ]
    assert [turns[0] > 30, turns[1] < -30] == [follows] * 2
    assert follows or max(map(abs, turns)) < 30


def test_rejections_are_counted_by_reason_and_logged_once_per_period() -> None:
    rejections = RejectionCounter()
    nan, frame = (
        RejectedInputError('not finite', 'Bad.'),
        RejectedInputError('unknown frame', 'Odd.'),
    )
    message = [rejections.add(error, now) for error, now in ((nan, 0.0), (nan, 1.0), (frame, 1.0))]
    assert message == [
        'Refused (not finite, 1 so far): Bad.', None, 'Refused (unknown frame, 1 so far): Odd.',
    ]  # fmt: skip
    assert rejections.add(nan, 5.0) == 'Refused (not finite, 3 so far): Bad.'
    assert rejections.add(ValueError('Far.'), 5.0) == 'Refused (not usable, 1 so far): Far.'
    assert rejections.counts == {'not finite': 3, 'unknown frame': 1, 'not usable': 1}
    assert rejections.recent(14.0, 10)
    assert not rejections.recent(16.0, 10)
