"""Moments against an 80-digit evaluation, against samples, and their invariances."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from precise_moments import PreciseGP

from likeme_gaze import GaussianProcesses

Array = NDArray[np.float64]
ROOT = np.random.default_rng(3).normal(size=(3, 3))
FULL = ROOT @ ROOT.T
LINE = np.outer([1.0, 2.0, -1.0], [1.0, 2.0, -1.0])
GRADED = np.array([[1e8, 0.5, 1e3], [0.5, 1e-8, 1e-5], [1e3, 1e-5, 1.0]])


def problem(
    lengthscale: float = 1.0, noise: float = 0.03, n: int = 10, seed: int = 0
) -> tuple[Array, ...]:
    """Inputs, targets and log hyperparameters of two outputs over three inputs."""
    rng = np.random.default_rng(seed)
    inputs = rng.normal(size=(n, 3))
    targets = 3 * np.sin(inputs @ rng.normal(size=(3, 2))) + 0.3 * rng.normal(size=(n, 2))
    logs = np.log(lengthscale) + 0.3 * rng.normal(size=(2, 3))
    return inputs, targets, logs, np.log([3.0, 2.0]), np.log([noise, 2 * noise])


@pytest.mark.parametrize(
    ('lengthscale', 'covariance', 'distance'),
    [
        pytest.param(1.0, FULL, 1.0, id='ordinary'),
        pytest.param(1.0, 1e-14 * FULL, 1.0, id='tiny'),
        pytest.param(1.0, 1e-6 * FULL, 1.0, id='small'),
        pytest.param(1.0, 1e6 * FULL, 1.0, id='huge'),
        pytest.param(1.0, 1e12 * FULL, 1.0, id='enormous'),
        pytest.param(1.0, LINE, 1.0, id='singular'),
        pytest.param(1.0, 1e6 * LINE, 1.0, id='singular and huge'),
        pytest.param(1.0, 1e9 * LINE, 1.0, id='singular and enormous'),
        pytest.param(1.0, LINE + 1e-12 * np.eye(3), 1.0, id='nearly singular'),
        pytest.param(1.0, GRADED, 1.0, id='sixteen orders of magnitude'),
        pytest.param(30.0, 1e-6 * FULL, 1.0, id='long lengthscales, small'),
        pytest.param(1e3, FULL, 1.0, id='lengthscales of 1000'),
        pytest.param(1e6, FULL, 1.0, id='lengthscales of a million'),
        pytest.param(0.05, FULL, 1.0, id='short lengthscales'),
        pytest.param(1.0, 1e-8 * FULL, 10.0, id='tiny, far from the data'),
        pytest.param(1.0, 100 * FULL, 30.0, id='wide, far from the data'),
    ],
)
def test_agrees_with_80_digits(lengthscale: float, covariance: Array, distance: float) -> None:
    arguments = problem(lengthscale)
    mean = distance * np.array([0.4, -0.7, 0.2])
    found = GaussianProcesses.from_hyperparameters(*arguments).propagate(mean, covariance)
    precise = PreciseGP(*arguments).propagate(mean, covariance)
    for got, wanted in zip(found, precise, strict=True):
        assert np.abs(got - wanted).max() <= 1e-9 * np.abs(wanted).max()


@pytest.mark.parametrize('size', [1e-14, 1e-10, 1e-6])
def test_small_covariances_between_outputs_keep_nine_digits(size: float) -> None:
    """Each by itself: the textbook's difference has none left here."""
    arguments = problem()
    found = GaussianProcesses.from_hyperparameters(*arguments).propagate(
        [0.4, -0.7, 0.2], size * FULL
    )
    precise = PreciseGP(*arguments).propagate(np.array([0.4, -0.7, 0.2]), size * FULL)
    assert found.covariance[0, 1] == pytest.approx(precise.covariance[0, 1], rel=1e-9)
    assert found.input_output_covariance == pytest.approx(
        precise.input_output_covariance, rel=1e-9
    )


@pytest.mark.parametrize('with_trend', [False, True])
def test_agrees_with_samples(with_trend: bool) -> None:
    gp = GaussianProcesses.from_hyperparameters(*problem(n=25), with_trend)
    mean, covariance = np.array([0.4, -0.7, 0.2]), 0.3 * FULL
    rng = np.random.default_rng(1)
    points = rng.multivariate_normal(mean, covariance, 100_000)
    at = gp.regress(points, np.zeros((len(points), 3, 3)))
    found = gp.propagate(mean, covariance)
    away, off = points - mean, at.mean - found.mean
    own = np.eye(2) * np.diagonal(at.covariance, axis1=1, axis2=2)[:, None, :]
    for got, samples in (
        (found.mean, at.mean),
        (found.covariance, off[:, :, None] * off[:, None, :] + own),
        (found.input_output_covariance, away[:, :, None] * off[:, None, :]),
    ):
        error = samples.std(axis=0) / np.sqrt(len(points))
        assert (np.abs(got - samples.mean(axis=0)) <= 4.5 * error).all()


def test_a_trend_is_the_limit_of_a_linear_kernel() -> None:
    inputs, targets, logs, signal, noise = problem(n=20)
    gp = GaussianProcesses.from_hyperparameters(inputs, targets, logs, signal, noise, True)
    at = np.array([0.4, -0.7, 0.2])
    found = gp.propagate(at, np.zeros((3, 3)))
    for e in range(2):
        scaled, point = inputs / np.exp(logs[e]), at / np.exp(logs[e])

        def kernel(a: Array, b: Array, s: float = signal[e]) -> Array:
            away = ((a[:, None] - b[None]) ** 2).sum(axis=-1)
            return np.asarray(np.exp(2 * s - away / 2))

        ones, far = np.ones((20, 1)), 1e6
        basis, mine = np.hstack([ones, inputs]), np.hstack([[1.0], at])
        k = kernel(scaled, scaled) + np.exp(2 * noise[e]) * np.eye(20) + far * basis @ basis.T
        row = kernel(point[None], scaled)[0] + far * mine @ basis.T
        solved = np.linalg.solve(k, row)
        own = np.exp(2 * signal[e]) + far * mine @ mine - row @ solved + np.exp(2 * noise[e])
        assert found.mean[e] == pytest.approx(solved @ targets[:, e], rel=1e-4)
        assert found.covariance[e, e] == pytest.approx(own, rel=1e-4)


def test_batch_equals_single_inputs() -> None:
    gp = GaussianProcesses.from_hyperparameters(*problem())
    rng = np.random.default_rng(2)
    means = rng.normal(size=(4, 5, 3))
    covariances = np.einsum('...ij,...kj->...ik', *2 * [rng.normal(size=(4, 5, 3, 3))])
    together = gp.propagate(means, covariances)
    assert [a.shape for a in together] == [(4, 5, 2), (4, 5, 2, 2), (4, 5, 3, 2)]
    alone = gp.propagate(means[2, 3], covariances[2, 3])
    for all_of_them, one in zip(together, alone, strict=True):
        assert all_of_them[2, 3] == pytest.approx(one, rel=1e-12)


def test_an_empty_batch() -> None:
    gp = GaussianProcesses.from_hyperparameters(*problem())
    found = gp.propagate(np.zeros((0, 3)), np.zeros((0, 3, 3)))
    assert [a.shape for a in found] == [(0, 2), (0, 2, 2), (0, 3, 2)]


numbers = st.floats(-3, 3)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
roots = st.lists(numbers, min_size=9, max_size=9).map(lambda v: np.reshape(v, (3, 3)))
sizes = st.sampled_from([0.0, 1e-9, 1e-3, 1.0, 1e3])
GP = GaussianProcesses.from_hyperparameters(*problem(n=20))


@settings(max_examples=60, deadline=None, derandomize=True)
@given(vectors, roots, sizes)
def test_joint_covariance_is_positive_semidefinite(mean: Array, root: Array, size: float) -> None:
    covariance = size * root @ root.T
    found = GP.propagate(mean, covariance)
    least = np.linalg.eigvalsh(found.covariance).min()
    assert least > 0.9 * GP.noise_variance.min()
    # What is left of the output once the input is known is a covariance of at least the noise.
    gain = GP.regress(mean[None], covariance[None]).gain[0]
    rest = found.covariance - gain.T @ covariance @ gain - np.diag(GP.noise_variance)
    assert np.linalg.eigvalsh(rest).min() > -1e-9 * np.abs(found.covariance).max()


@settings(max_examples=40, deadline=None, derandomize=True)
@given(vectors, roots, vectors)
def test_moments_are_translation_invariant(mean: Array, root: Array, by: Array) -> None:
    inputs, targets, *logs = problem(n=20)
    moved = GaussianProcesses.from_hyperparameters(inputs + by, targets, *logs)
    covariance = root @ root.T
    pairs = zip(
        moved.propagate(mean + by, covariance), GP.propagate(mean, covariance), strict=True
    )
    for one, other in pairs:
        assert one == pytest.approx(other, rel=1e-6, abs=1e-8)


@pytest.mark.parametrize('size', [1.0, 1e3, 1e7])
def test_moments_do_not_depend_on_units(size: float) -> None:
    """Nor do they decide when extended precision is needed: cm² are no measure for rad²."""
    inputs, targets, logs, *rest = problem(n=20)
    units, mean = np.array([1024.0, 1.0, 1 / 64]), np.array([0.4, -0.7, 0.2])
    other = GaussianProcesses.from_hyperparameters(
        inputs * units, targets, logs + np.log(units), *rest
    )
    found = other.propagate(mean * units, size * FULL * units[:, None] * units)
    wanted = GP.propagate(mean, size * FULL)
    assert found.mean == pytest.approx(wanted.mean, rel=1e-9, abs=1e-12)
    assert found.covariance == pytest.approx(wanted.covariance, rel=1e-9, abs=1e-12)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(vectors)
def test_prior_moments_far_from_the_data(mean: Array) -> None:
    found = GP.propagate(mean + 1e4, np.zeros((3, 3)))
    assert found.mean == pytest.approx([0, 0])
    assert np.diag(found.covariance) == pytest.approx(
        np.exp(2 * GP.log_signal_std) + GP.noise_variance
    )


@pytest.mark.parametrize(
    ('mean', 'covariance', 'sentence'),
    [
        ([0, 0], np.eye(3), r'Expected mean of shape \(3,\), got \(2,\)'),
        ([0, 0, np.nan], np.eye(3), 'Expected mean to be finite, got nan'),
        ([0, 0, 0], np.eye(2), r'Expected covariance of shape \(3, 3\), got \(2, 2\)'),
        ([0, 0, 0], -np.eye(3), 'Expected covariance with variances of at least 0, got -1'),
        ([0, 0, 0], np.eye(3) + np.eye(3, k=1), 'Expected covariance to be symmetric'),
        ([0, 0, 0], np.ones((3, 3)) - np.diag([0, 0, 0.5]), 'semidefinite'),
        ('abc', np.eye(3), 'Expected mean to be numbers'),
    ],
)
def test_invalid_gaussians_are_rejected(mean: object, covariance: Array, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        GP.propagate(mean, covariance)  # type: ignore[arg-type]


def test_invalid_training_data_are_rejected() -> None:
    inputs, targets, logs, signal, noise = problem()
    make = GaussianProcesses.from_hyperparameters
    with pytest.raises(ValueError, match=r'targets of shape \(10, n\), got \(9, 2\)'):
        make(inputs, targets[:9], logs, signal, noise)
    with pytest.raises(ValueError, match=r'log_lengthscales of shape \(2, 3\), got \(2, 2\)'):
        make(inputs, targets, logs[:, :2], signal, noise)
    with pytest.raises(ValueError, match='Expected targets to be finite, got inf'):
        make(inputs, targets + np.inf, logs, signal, noise)
    with pytest.raises(ValueError, match='Expected noise that keeps the kernel matrix of 20'):
        make(np.vstack([inputs] * 2), np.vstack([targets] * 2), logs, signal, noise - 40)
