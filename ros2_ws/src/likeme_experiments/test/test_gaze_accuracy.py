"""Accuracy of gaze inference against the exact posterior and the bars of Fig 5."""

from __future__ import annotations

import numpy as np

from likeme_experiments.evaluation.gaze_accuracy import gaze_accuracy, gaze_errors, gaze_test
from likeme_experiments.evaluation.gaze_exact import exact_goal, gap
from likeme_gaze import (
    Evidence,
    Gaussian,
    GazeModel,
    SimulationSetup,
    goal_prior,
    infer_goal,
    known,
)
from likeme_gaze.beliefs import independent
from likeme_gaze.simulation import aim, execute

SETTING = SimulationSetup()
PRIOR = SETTING.mentor.belief_from_parent(goal_prior(SETTING.agent, SETTING.mentor))


def test_the_gaussian_posterior_is_close_to_the_exact_one() -> None:
    head = GazeModel.simulated(11, points=120).head
    rng = np.random.default_rng(8)
    goal, start = np.array([330.0, -180.0]), np.array([0.3] * 5)
    _, final = execute(rng, np.tile(aim(goal, start[0]), (5, 1)), start, SETTING)
    prior = independent(PRIOR, known([0.3]))
    found = infer_goal(head, prior, Evidence(5, final.mean(axis=0)))
    answer = Gaussian(found.mean[:2], found.covariance[:2, :2])
    exact = exact_goal(rng, head, PRIOR, 0.3, final, answer, samples=40_000)
    assert exact.effective > 4_000
    away = gap(answer, exact.belief)
    assert away['shift'] < 0.1
    assert 0.97 < away['widths'] < 1.12
    assert away['kl'] < 0.02


def test_accuracy_of_one_agent() -> None:
    """One seed of Fig 5, within the bounds for six."""
    errors = gaze_accuracy(21)
    assert errors.reverse.shape == errors.following.shape == errors.covered.shape == (5, 375)
    assert np.median(np.abs(errors.forward)) < 1.5
    for found in (errors.reverse, errors.following):
        assert np.median(np.abs(found[-1])) < 1.8
        assert np.quantile(np.abs(found[-1]), 0.9) < 5.0
        assert np.median(np.abs(found[-1])) < np.median(np.abs(found[0]))
    assert 0.88 < errors.covered[-1].mean() <= 1.0


def test_errors_are_reproducible_by_seed() -> None:
    test = gaze_test(np.random.default_rng(1))
    few = test._replace(
        goal=test.goal[:3],
        agent_start=test.agent_start[:3],
        mentor_start=test.mentor_start[:3],
        final=test.final[:, :3],
    )
    one, other = (gaze_errors(GazeModel.simulated(3, 40).head, few) for _ in range(2))
    assert (one.following == other.following).all()
