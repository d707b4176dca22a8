"""The simulated mentor of gaze.sh: what it does, and how a turn is scored."""

from __future__ import annotations

import math

import numpy as np
import pytest

from likeme_experiments.evaluation.mentor_trials import (
    GazeTrial,
    MentorScene,
    RobotResponse,
    draw_trials,
    inside,
    line,
    score,
    summary,
    turn_of,
)
from likeme_gaze import Gaussian, Pose2

SCENE = MentorScene('base_link', Pose2(0.0, 0.0, 0.0), Pose2(6.0, 0.0, math.pi), 5)
ELSEWHERE = MentorScene('base_link', Pose2(1.0, 2.0, 0.5), Pose2(-2.0, -2.0, 0.0), 3)


def draw(scene: MentorScene = SCENE, count: int = 4) -> list[GazeTrial]:
    return list(draw_trials(np.random.default_rng(3), scene, count))


def test_trials_are_balanced_and_reproducible() -> None:
    assert sorted(trial.side for trial in draw()) == [-1, -1, 1, 1]
    assert sum(trial.side for trial in draw(count=5)) in (-1, 1)
    assert draw() == draw()


@pytest.mark.parametrize('scene', [SCENE, ELSEWHERE])
def test_the_target_is_at_45_degrees_for_both(scene: MentorScene) -> None:
    for trial in draw(scene):
        to_target = scene.robot.facing(*trial.target).heading - scene.robot.heading
        turn = turn_of(scene, RobotResponse(Gaussian(np.zeros(2), np.eye(2)), to_target))
        assert turn == pytest.approx(trial.side * math.pi / 4)
        assert trial.start == scene.mentor.facing(scene.robot.x, scene.robot.y)
        assert len(trial.turns) == scene.observations
        for pose, distance in trial.turns:
            off = scene.mentor.facing(*trial.target).heading - pose.heading
            assert math.remainder(off, 2 * math.pi) == pytest.approx(0, abs=0.3)
            assert distance == pytest.approx(scene.away / math.sqrt(2), abs=0.5)


@pytest.mark.parametrize(('degrees', 'points'), [(30.1, 1), (29.9, 0), (-29.9, 0), (-30.1, -1)])
def test_thirty_degrees_count(degrees: float, points: int) -> None:
    for trial in draw():
        assert score(trial, trial.side * math.radians(degrees)) == points


def test_a_line_and_the_summary() -> None:
    trial = draw()[0]._replace(side=1, target=(3.0, 3.0))
    goal = Gaussian(np.array([3.25, 2.5]), np.diag([1.0, 0.25]))
    text = line(7, SCENE, trial, RobotResponse(goal, math.radians(39.12)))
    assert ' '.join(text.split()) == (
        '7 left (3.00, 3.00) m (3.25 ± 1.00, 2.50 ± 0.50) yes 39.1 degrees left +1'
    )
    assert not inside(trial, RobotResponse(goal._replace(covariance=goal.covariance / 100), 0.0))
    assert summary([1, 1, 0, -1]).startswith('Score +1 of 4, mean 0.25: ')
