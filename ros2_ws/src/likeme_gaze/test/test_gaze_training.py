"""Hyperparameters: the right gradient, outputs without noise, few and odd points."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from likeme_gaze import HyperparameterSearch, fit
from likeme_gaze.gp.kernel import likelihood_and_gradient, squared_distances
from likeme_gaze.gp.training import MIN_POINTS
from likeme_gaze.gp.trend import basis_for

RNG = np.random.default_rng(4)
INPUTS = RNG.uniform(-2, 2, (60, 2))
SMOOTH = np.stack([np.sin(2 * INPUTS[:, 0]), INPUTS @ [50.0, -20.0] + 300], axis=1)


@pytest.mark.parametrize('with_trend', [False, True])
def test_gradient_of_the_likelihood(with_trend: bool) -> None:
    squared, target = squared_distances(INPUTS), SMOOTH[:, 0] + 0.1 * RNG.normal(size=60)
    columns = basis_for(INPUTS).of(INPUTS) if with_trend else None
    at = np.array([0.1, -0.3, 0.4, -1.5])
    _, gradient = likelihood_and_gradient(at, squared, target, columns)

    def value(logs: np.ndarray) -> float:
        return likelihood_and_gradient(logs, squared, target, columns)[0]

    assert gradient == pytest.approx(approx_fprime(at, value, 1e-7), rel=1e-4, abs=1e-4)


def test_finds_noise_and_function() -> None:
    noise = np.array([0.1, 5.0])
    gp = fit(INPUTS, SMOOTH + noise * RNG.normal(size=(60, 2)))
    assert np.sqrt(gp.noise_variance) == pytest.approx(noise, rel=0.4)
    rng = np.random.default_rng(5)
    fresh = rng.uniform(-1.5, 1.5, (50, 2))
    found = gp.regress(fresh, np.zeros((50, 2, 2))).mean
    wanted = np.stack([np.sin(2 * fresh[:, 0]), fresh @ [50.0, -20.0] + 300], axis=1)
    assert np.sqrt(((found - wanted) ** 2).mean(axis=0)) == pytest.approx([0, 0], abs=3)
    assert np.abs(found - wanted)[:, 0].mean() < 0.1


def test_an_output_without_noise_is_learned() -> None:
    gp = fit(INPUTS, SMOOTH)
    found = gp.propagate(INPUTS, np.zeros((60, 2, 2)))
    assert np.abs(found.mean - SMOOTH).max() < 0.05 * SMOOTH.std(axis=0).max()
    floor = HyperparameterSearch().noise[0] * SMOOTH.std(axis=0)
    assert (np.sqrt(gp.noise_variance) >= 0.999 * floor).all()


def test_a_constant_output_and_repeated_points() -> None:
    inputs = np.vstack([INPUTS[:8]] * 2)
    gp = fit(inputs, np.full((16, 1), 7.0))
    assert gp.propagate([0.3, 0.1], np.eye(2)).mean == pytest.approx([7.0], abs=0.05)


def test_the_same_points_give_the_same_model() -> None:
    one, other = fit(INPUTS, SMOOTH), fit(INPUTS, SMOOTH)
    assert (one.log_lengthscales == other.log_lengthscales).all()


def test_too_few_points_and_collinear_inputs_are_rejected() -> None:
    few = MIN_POINTS - 1
    with pytest.raises(ValueError, match=f'at least {MIN_POINTS} training points, got {few}'):
        fit(INPUTS[:few], SMOOTH[:few])
    line = np.outer(np.arange(12.0), [1.0, 2.0])
    with pytest.raises(ValueError, match='determine a trend of 3 coefficients, got 12 points'):
        fit(line, SMOOTH[:12])
    with pytest.raises(ValueError, match='Expected targets to be finite'):
        fit(INPUTS, np.full((60, 1), np.nan))
