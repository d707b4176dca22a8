"""Forward and reverse inference against samples and explicit formulas."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_gaze import (
    Evidence,
    Gaussian,
    GazeModel,
    HeadModel,
    SimulationSetup,
    forward_inference,
    goal_prior,
    infer_goal,
    known,
    reverse_inference,
    self_experience,
)
from likeme_gaze.beliefs import independent, mahalanobis
from likeme_gaze.chain import chain, execution_noise
from likeme_gaze.simulation import DEGREE, aim

SETTING = SimulationSetup()
GOAL = Gaussian(np.array([320.0, 150.0]), np.array([[900.0, 200.0], [200.0, 600.0]]))
START = Gaussian(np.array([0.2]), np.array([[0.01]]))
PRIOR = SETTING.mentor.belief_from_parent(goal_prior(SETTING.agent, SETTING.mentor))


@pytest.fixture(scope='module')
def head() -> HeadModel:
    return GazeModel.simulated(11, points=120).head


def samples(head: HeadModel, goal: Gaussian, start: Gaussian, n: int) -> tuple[np.ndarray, ...]:
    """Goals with starts, actions and final states drawn from the learned model."""
    rng = np.random.default_rng(6)
    belief = independent(goal, start)
    z = rng.multivariate_normal(*belief, n)
    drawn = []
    inputs = z
    for gp in head:
        found = gp.regress(inputs, np.zeros((n, 3, 3)))
        spread = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
        drawn.append(found.mean + spread * rng.standard_normal((n, 2)))
        inputs = np.hstack([drawn[-1], z[:, 2:]])
    return z, *drawn


def test_forward_inference_agrees_with_samples(head: HeadModel) -> None:
    found = forward_inference(head, GOAL, START)
    _, action, final = samples(head, GOAL, START, 8_000)
    for belief, drawn in ((found.action, action), (found.final, final)):
        scale = drawn.std(axis=0)
        assert belief.mean / scale == pytest.approx(drawn.mean(axis=0) / scale, abs=0.08)
        size = scale[:, None] * scale
        assert belief.covariance / size == pytest.approx(np.cov(drawn.T) / size, abs=0.08)


def test_the_coupling_of_action_and_start_matters(head: HeadModel) -> None:
    """Where the head starts and how far it turns cancel in where it ends."""
    _, _, final = samples(head, GOAL, START, 8_000)
    kept = forward_inference(head, GOAL, START).final.covariance[0, 0]
    dropped = forward_inference(head, GOAL, START, keep_coupling=False).final.covariance[0, 0]
    assert kept == pytest.approx(np.var(final[:, 0]), rel=0.1)
    assert dropped > 1.5 * kept


def test_reverse_inference_equals_the_paper_formula(head: HeadModel) -> None:
    """With J = C S⁻¹ formed: m_g + J (m_a|xf - m_a) and S_g - J (S_a - S_a|xf) J'."""
    observed = np.array([0.5, 370.0])
    found = reverse_inference(head, GOAL, START, observed)
    linear = found.predicted
    cross = linear.moved.covariance @ linear.by_action
    gain = np.linalg.solve(linear.final.covariance, cross.T).T
    moved = linear.moved.mean + gain @ (observed - linear.final.mean)
    left = linear.moved.covariance - gain @ cross.T
    j = np.linalg.solve(linear.moved.covariance, linear.cross.T).T
    mean = linear.start.mean + j @ (moved - linear.moved.mean)
    covariance = linear.start.covariance - j @ (linear.moved.covariance - left) @ j.T
    assert found.goal_and_start.mean == pytest.approx(mean, rel=1e-7)
    assert found.goal_and_start.covariance == pytest.approx(covariance, rel=1e-6, abs=1e-8)
    assert found.action.mean == pytest.approx(moved[:2])


def test_a_known_start_is_not_moved(head: HeadModel) -> None:
    found = reverse_inference(head, GOAL, known([0.2]), np.array([0.5, 370.0]))
    assert found.goal_and_start.mean[2] == 0.2
    assert not found.goal_and_start.covariance[2].any()


def test_model_uncertainty_does_not_average_out(head: HeadModel) -> None:
    """A million executions average out their noise, not the model uncertainty."""
    prior = independent(PRIOR, known([0.1]))
    final = np.array([0.4, 380.0])
    widths = [
        float(np.linalg.det(infer_goal(head, prior, Evidence(k, final)).covariance[:2, :2]))
        for k in (1, 5, 25, 1_000_000)
    ]
    assert widths[0] > widths[1] > widths[2] > widths[3] > 0
    belief = infer_goal(head, prior, Evidence(1_000_000, final))
    linear = chain(head, belief)
    own = linear.final.covariance - execution_noise(head, linear)
    assert np.linalg.eigvalsh(own).min() > 0


def test_without_a_distance_the_goal_lies_somewhere_along_the_line_of_sight(
    head: HeadModel,
) -> None:
    prior = independent(PRIOR, known([0.0]))
    found = infer_goal(head, prior, Evidence(5, np.array([0.4])))
    # The wedge of the plane that the line of sight leaves of the prior, on a fine grid.
    x, y = np.meshgrid(np.linspace(-300, 1200, 301), np.linspace(-900, 900, 361))
    places = np.stack([x.ravel(), y.ravel()], axis=-1)
    off = (np.arctan2(places[:, 1], places[:, 0]) - 0.4) / (2.5 * DEGREE)
    weight = np.exp(-0.5 * (off**2 + mahalanobis(PRIOR, places)))
    wedge = weight @ places / weight.sum()
    assert found.mean[:2] == pytest.approx(wedge, abs=40)
    widths, directions = np.linalg.eigh(found.covariance[:2, :2])
    assert np.sqrt(widths[1]) > 100 > 2 * np.sqrt(widths[0])
    assert np.arctan(directions[1, 1] / directions[0, 1]) == pytest.approx(0.4, abs=0.25)


def test_statistics_of_self_experience() -> None:
    seen = self_experience(np.random.default_rng(0), 4000)
    off = seen.action - aim(seen.goal, seen.start)
    assert off.std(axis=0) == pytest.approx([3 * DEGREE, 10.0], rel=0.05)
    turned = seen.final[:, 0] - seen.start - seen.action[:, 0]
    assert turned.std() == pytest.approx(3 * DEGREE, rel=0.05)
    assert (seen.final[:, 1] == seen.action[:, 1]).all()
    assert seen.start.std() == pytest.approx(30 * DEGREE, rel=0.05)
    assert seen.goal.min(axis=0) == pytest.approx([100, -500], abs=3)
    assert seen.goal.max(axis=0) == pytest.approx([500, 500], abs=3)
