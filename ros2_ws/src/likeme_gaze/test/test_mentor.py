"""A watched mentor without ROS: frames and units, refusals, stamps, distances, settings."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mentors import TO_LEFT, TO_RIGHT, TO_ROBOT, head, settings, yaw

from likeme_gaze import Gaussian, GazeFollower, GazeModel, Pose2
from likeme_gaze.mentor.head_pose import Frames, heading, planar
from likeme_gaze.mentor.refusals import Refusals, RefusedError
from likeme_gaze.mentor.watch import Answer, MentorWatch

FRAMES = Frames('base_link', 'mentor', Pose2(600.0, 0.0, math.pi))
angles = st.floats(-3.1, 3.1)


@cache
def model(points: int = 60) -> GazeModel:
    return settings(training_points=points).learning.model()


def watch(**changes: Any) -> MentorWatch:
    return MentorWatch(model(), settings(**changes).watching)


def look(watching: MentorWatch, angle: float, begin: float = 100.0, **more: Any) -> list[Answer]:
    """Show one whole trial; the answers."""
    watching.start(head(begin, **more))
    seen = range(1, watching.settings.observations + 1)
    answers = [watching.observe(head(begin + k, angle, **more)) for k in seen]
    return [answer for answer in answers if answer is not None]


@given(angles, st.floats(-0.7, 0.7), st.floats(-1.0, 1.0))
def test_a_heading_is_the_yaw_whatever_pitch_and_roll(
    turn: float, pitch: float, roll: float
) -> None:
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
def test_metres_of_the_mentors_frame_become_centimetres_of_the_robots(
    x: float, y: float, turn: float
) -> None:
    seen = planar(head(1, turn, (x, y, 1.5), 'mentor'), FRAMES)
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
        (head(1, orientation=(0, 0, math.nan, 1)), 'not finite', 'got (0, 0, nan, 1)'),
        (head(1, orientation=(0, 0, 0, 0)), 'quaternion', 'of length 1 within 0.01, got 0.'),
        (head(1, orientation=(0, 0, 0.6, 0.9)), 'quaternion', 'got 1.082.'),
        (head(1, orientation=(0, 0.5**0.5, 0, 0.5**0.5)), 'no heading', 'straight up or down'),
    ],
)
def test_a_pose_that_cannot_be_used_is_refused(pose: Any, reason: str, why: str) -> None:
    with pytest.raises(RefusedError) as refused:
        planar(pose, FRAMES)
    assert refused.value.reason == reason
    assert why in str(refused.value)


@pytest.mark.parametrize(('angle', 'side'), [(TO_LEFT, 1), (TO_RIGHT, -1)])
def test_the_answers_are_those_of_the_library(angle: float, side: int) -> None:
    answers = look(watch(), angle)
    wide = Gaussian(np.array([300.0, 0.0]), np.diag([115.0**2, 289.0**2]))
    follower = GazeFollower(model(), Pose2(0, 0, 0), prior=wide)
    follower.start(Pose2(600, 0, TO_ROBOT))
    expected = [follower.observe(Pose2(600, 0, angle)) for _ in answers][-1]
    last = answers[-1]
    assert last.goal is not None
    np.testing.assert_allclose(last.goal.mean * 100, expected.goal.mean, atol=1e-6)
    np.testing.assert_allclose(last.goal.covariance * 1e4, expected.goal.covariance, atol=1e-4)
    assert last.neck[0] == pytest.approx(expected.action.mean[0])
    assert side * math.degrees(last.neck[0]) > 30
    assert [answer.turn for answer in answers] == [False] * 4 + [True]
    assert (last.height, last.observations, last.stamp) == (1.2, 5, 105 * 10**9)


def test_the_same_mentor_in_its_own_frame_and_a_robot_elsewhere() -> None:
    base = look(watch(), TO_LEFT)[-1]
    own = watch()
    own.start(head(100, 0.0, (0, 0, 1.2), 'mentor'))
    in_own = [own.observe(head(101 + k, -math.pi / 4, (0, 0, 1.2), 'mentor')) for k in range(5)]
    # All turned by 90 degrees and moved by (1, 2) m.
    moved = watch(robot_head=[1.0, 2.0, math.pi / 2])
    place = (1.0, 8.0, 1.2)
    moved.start(head(100, TO_ROBOT + math.pi / 2, place))
    turned = [moved.observe(head(101 + k, TO_LEFT + math.pi / 2, place)) for k in range(5)]
    assert base.goal is not None
    for answer, goal in (
        (in_own[-1], base.goal.mean),
        (turned[-1], (1, 2) + base.goal.mean[::-1] * (-1, 1)),
    ):
        assert answer is not None
        assert answer.goal is not None
        np.testing.assert_allclose(answer.goal.mean, goal, atol=1e-6)
        assert answer.neck[0] == pytest.approx(base.neck[0], abs=1e-6)


def refused_as(reason: str, act: Callable[[], object]) -> str:
    with pytest.raises(RefusedError) as refused:
        act()
    assert refused.value.reason == reason
    return str(refused.value)


def test_observations_need_a_start_and_come_to_an_end() -> None:
    watching = watch(observations=2)
    said = refused_as('no start pose', lambda: watching.observe(head(1)))
    assert 'got none' in said
    look(watching, TO_LEFT)
    said = refused_as('enough seen', lambda: watching.observe(head(103)))
    assert said == 'Expected 2 head poses after a start pose, got one more.'


def test_stamps_go_up() -> None:
    watching = watch()
    watching.start(head(100))
    watching.observe(head(101, TO_LEFT))
    said = refused_as('stamp', lambda: watching.observe(head(101, TO_LEFT)))
    assert said.endswith('101.000 s, got 101.000 s.')
    refused_as('stamp', lambda: watching.observe(head(99, TO_LEFT)))
    assert watching.observations == 1
    refused_as('stamp', lambda: watching.start(head(100.5)))
    assert watching.observations == 1


def test_a_recording_may_begin_again() -> None:
    watching = watch()
    look(watching, TO_LEFT)
    refused_as('stamp', lambda: watching.start(head(10)))
    assert len(look(watching, TO_LEFT, 20)) == 5


def test_a_start_pose_that_cannot_be_read_ends_the_mentor_before() -> None:
    watching = watch()
    watching.start(head(100))
    refused_as('not finite', lambda: watching.start(head(101, place=(math.nan, 0, 0))))
    refused_as('no start pose', lambda: watching.observe(head(102)))
    with pytest.raises(ValueError, match='at least 10 cm from the agent'):
        watching.start(head(103, place=(0.05, 0, 1)))
    refused_as('no start pose', lambda: watching.observe(head(104)))


@pytest.mark.parametrize('place', [(6.5, 0.0, 1.2), (1e300, 0.0, 1.2)])
def test_a_mentor_who_walked_away_changes_nothing(place: tuple[float, float, float]) -> None:
    watching = watch()
    watching.start(head(100))
    before = watching.observe(head(101, TO_LEFT))
    with pytest.raises(ValueError, match='within 30 cm of its start place'):
        watching.observe(head(102, TO_LEFT, place))
    after = watching.observe(head(102, TO_LEFT))
    assert before is not None
    assert after is not None
    assert after.observations == 2


def test_distances_find_their_head_poses_in_either_order() -> None:
    watching = watch(use_distance=True, observations=3)
    watching.start(head(100))
    assert watching.observe(head(101, TO_LEFT)) is None
    first = watching.measure(101 * 10**9, 4.24)
    assert watching.measure(102 * 10**9, 4.24) is None
    second = watching.observe(head(102, TO_LEFT))
    assert watching.measure(999, 4.0) is None
    refused_as('distance', lambda: watching.measure(103 * 10**9, -1.0))
    refused_as('distance', lambda: watching.measure(103 * 10**9, math.nan))
    assert first is not None
    assert second is not None
    assert (first.observations, second.observations) == (1, 2)
    assert second.goal is not None
    np.testing.assert_allclose(second.goal.mean, (3.0, 3.0), atol=0.3)
    for k in range(10):
        assert watching.observe(head(110 + k, TO_LEFT)) is None
    said = refused_as('no distance', lambda: watching.observe(head(120, TO_LEFT)))
    assert 'got none for 11 of them' in said


@pytest.mark.parametrize(
    ('change', 'why'),
    [
        ({'blindfold_experience': 'wool'}, "none, windowed, opaque, got 'wool'"),
        ({'prior_std': [1.0, 0.0]}, 'Expected prior_std of more than 0 m, got 0.'),
        ({'prior_std': [1.0]}, 'Expected prior_std as 2 finite numbers, got [1.0].'),
        ({'mentor_pose': [1, 2, math.nan]}, 'Expected mentor_pose as 3 finite numbers'),
        ({'robot_head': None}, 'Expected robot_head as 3 finite numbers, got [None].'),
        ({'mentor_frame': 'base_link'}, "got 'base_link' twice"),
        ({'head_joint': ''}, 'Expected a name as head_joint, got an empty one.'),
    ],
)
def test_settings_that_make_no_sense_are_refused(change: dict[str, Any], why: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        settings(**change)
    assert why in str(refused.value)


def test_too_few_training_points_are_refused() -> None:
    with pytest.raises(ValueError, match='at least 5 training points, got 3'):
        settings(training_points=3).learning.model()


@pytest.mark.parametrize(
    ('experience', 'follows'), [('none', True), ('windowed', True), ('opaque', False)]
)
def test_who_knows_opaque_blindfolds_does_not_follow_them(experience: str, follows: bool) -> None:
    chosen = settings(training_points=60, blindfold_experience=experience, mentor_blindfolded=True)
    watching = MentorWatch(chosen.learning.model(), chosen.watching)
    turns = [
        math.degrees(look(watching, a, b)[-1].neck[0])
        for a, b in ((TO_LEFT, 100), (TO_RIGHT, 200))
    ]
    assert [turns[0] > 30, turns[1] < -30] == [follows] * 2
    assert follows or max(map(abs, turns)) < 30


def test_refusals_are_counted_by_reason_and_said_once_in_a_while() -> None:
    refusals = Refusals()
    nan, frame = RefusedError('not finite', 'Bad.'), RefusedError('unknown frame', 'Odd.')
    said = [refusals.add(error, now) for error, now in ((nan, 0.0), (nan, 1.0), (frame, 1.0))]
    assert said == [
        'Refused (not finite, 1 so far): Bad.', None, 'Refused (unknown frame, 1 so far): Odd.',
    ]  # fmt: skip
    assert refusals.add(nan, 5.0) == 'Refused (not finite, 3 so far): Bad.'
    assert refusals.add(ValueError('Far.'), 5.0) == 'Refused (not usable, 1 so far): Far.'
    assert refusals.counts == {'not finite': 3, 'unknown frame': 1, 'not usable': 1}
    assert refusals.recent(14.0, 10)
    assert not refusals.recent(16.0, 10)
