"""The light, told by the colour of the table."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_perception.light import OVEREXPOSED, TOO_DARK, as_taught, light_of

TAUGHT = (205.0, 179.0, 144.0)


def seen(*factors: float) -> tuple[float, float, float]:
    """The table under a light, as an 8-bit camera sees it."""
    red, green, blue = (min(255.0, f * t) for f, t in zip(factors, TAUGHT, strict=True))
    return red, green, blue


@pytest.mark.parametrize('factors', [(1, 1, 1), (1.09, 0.92, 1.0)])
def test_a_usual_light_changes_nothing(factors) -> None:
    light = light_of(seen(*factors), TAUGHT)
    image = np.random.default_rng(0).integers(0, 256, (4, 5, 3), np.uint8)
    assert light.usual
    assert as_taught(image, light) is image


@pytest.mark.parametrize('factors', [(0.3, 0.3, 0.3), (1.15, 0.95, 0.6), (0.05, 0.05, 0.04)])
def test_colours_are_as_taught_under_another_light(factors) -> None:
    light = light_of(seen(*factors), TAUGHT)
    assert (light.reason, light.usual, light.clipped) == ('', False, False)
    assert light.factor == pytest.approx(factors)
    there = np.full((2, 2, 3), (120, 60, 180), np.uint8)
    lit = np.rint(there * factors).astype(np.uint8)
    step = 0.5 / min(factors)
    assert np.abs(as_taught(lit, light).astype(float) - there).max() < 2 * step + 2


def test_saturated_channels_follow_the_rest_if_that_explains_them() -> None:
    light = light_of(seen(1.5, 1.5, 1.5), TAUGHT)
    assert light.reason == ''
    assert light.factor == pytest.approx((1.5, 1.5, 1.5))
    assert light.clipped
    assert light.caps == (170, 170, 170)


@pytest.mark.parametrize('factors', [(2, 2, 2), (3, 3, 3), (1.8, 1.5, 1.0)])
def test_what_saturation_hides_is_not_guessed(factors) -> None:
    assert light_of(seen(*factors), TAUGHT).reason == OVEREXPOSED


def test_a_table_that_was_taught_white_is_not_overexposed() -> None:
    light = light_of((254, 252, 251), (253, 252, 250))
    assert (light.usual, light.clipped) == (True, False)


def test_almost_black_is_too_dark() -> None:
    assert light_of(seen(0.02, 0.02, 0.02), TAUGHT).reason == TOO_DARK
