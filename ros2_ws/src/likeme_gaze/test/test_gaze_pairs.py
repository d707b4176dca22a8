"""Sums over all pairs of training inputs, also where the blocks are incomplete."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from precise_moments import PreciseGP

from likeme_gaze import GaussianProcesses
from likeme_gaze.gp.pair_blocks import MIN_INPUTS, each_pair_once, every_pair

Array = NDArray[np.float64]


def training(n: int, seed: int = 0) -> tuple[Array, ...]:
    """n inputs of two dimensions, two outputs, their log hyperparameters."""
    rng = np.random.default_rng(seed)
    inputs = rng.normal(size=(n, 2))
    targets = np.sin(2 * inputs @ rng.normal(size=(2, 2))) + 0.1 * rng.normal(size=(n, 2))
    logs = np.log([[0.7, 1.1], [0.9, 0.6]])
    return inputs, targets, logs, np.log([1.5, 2.0]), np.log([0.2, 0.3])


@pytest.mark.parametrize('count', [1, 2, 49, 50, 51, 52, 53, 54, 55, 200])
def test_the_rectangles_hold_every_pair(count: int) -> None:
    rng = np.random.default_rng(count)
    table, other = (half + half.T for half in rng.normal(size=(2, count, count)))
    for blocks in (each_pair_once(count), every_pair(count)):
        at = blocks.rows[:, :, None], blocks.columns[:, None, :]
        folded = (blocks.folded(table) * other[at]).sum()
        assert folded == pytest.approx((table * other).sum(), rel=1e-10, abs=1e-10 * count)


def test_blocks_cover_three_fifths_of_the_table() -> None:
    assert each_pair_once(200).folded(np.ones((200, 200))).size == 0.6 * 200**2


@pytest.mark.parametrize('size', [1e-10, 0.3, 1e4])
def test_incomplete_blocks_agree_with_80_digits(size: float) -> None:
    arguments, mean = training(MIN_INPUTS + 3), np.array([0.3, -0.2])
    covariance = size * np.array([[1.0, 0.4], [0.4, 0.5]])
    found = GaussianProcesses.from_hyperparameters(*arguments).propagate(mean, covariance)
    precise = PreciseGP(*arguments).propagate(mean, covariance)
    for got, wanted in zip(found, precise, strict=True):
        assert np.abs(got - wanted).max() <= 1e-9 * np.abs(wanted).max()


def test_a_point_whose_exponents_are_large_is_that_point_alone() -> None:
    """In a batch: far away q is too small for a number, and the others are left as they are."""
    gp = GaussianProcesses.from_hyperparameters(*training(60))
    mean = np.array([[0.3, -0.2], [40.0, 60.0], [0.1, 0.4]])
    covariance = np.array([0.1, 900.0, 0.2])[:, None, None] * np.eye(2)
    together = gp.propagate(mean, covariance)
    for i in range(3):
        for batch, one in zip(together, gp.propagate(mean[i], covariance[i]), strict=True):
            assert batch[i] == pytest.approx(one, rel=1e-9)
    precise = PreciseGP(*training(60)).propagate(mean[1], covariance[1])
    assert together.covariance[1] == pytest.approx(precise.covariance, rel=1e-9, abs=1e-12)
