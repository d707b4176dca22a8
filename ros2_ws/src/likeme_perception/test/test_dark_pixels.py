"""The light, told by pixels that are darker than the table."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_core.table import DarkPlace
from likeme_perception.dark_pixels import DarkPixels, at_places, of_background

GREY, BLUE = (65.0, 69.0, 75.0), (35.0, 86.0, 178.0)


def dark_pixels(*colours: tuple[float, float, float]) -> DarkPixels:
    """Ten pixels of each colour, in the order of the image, 1 m away."""
    taught = np.repeat(np.array(colours, np.float32), 10, axis=0)
    return DarkPixels(np.arange(len(taught)), np.ones(len(taught), np.float32), taught)


def lit(dark: DarkPixels, *factors: float) -> np.ndarray:
    """These pixels under a light, as an 8-bit camera with noise sees them, (1, N, 3)."""
    noise = np.random.default_rng(0).normal(0, 1.5, dark.taught.shape)
    seen = (dark.taught + noise) * factors
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8)[None]


@pytest.mark.parametrize('factors', [(2, 2, 2), (3, 3, 3), (2.4, 2.0, 1.7)])
def test_the_factor_of_each_channel_is_that_of_the_clear_pixels(factors) -> None:
    dark = dark_pixels(GREY, GREY, BLUE)
    light = dark.light(lit(dark, *factors), np.ones((1, 30), np.float32))
    assert light is not None
    assert (light.reason, light.clipped) == ('', True)
    assert light.factor == pytest.approx(factors, rel=0.02)


def test_a_channel_that_no_pixel_tells_is_not_guessed() -> None:
    dark = dark_pixels(BLUE, BLUE)
    assert dark.light(lit(dark, 2, 2, 2), np.ones((1, 20), np.float32)) is None
    dark = dark_pixels(GREY, GREY)
    assert dark.light(lit(dark, 4, 4, 4), np.ones((1, 20), np.float32)) is None


def test_pixels_that_something_covers_do_not_count() -> None:
    dark = dark_pixels(GREY, GREY, GREY)
    seen, depth = lit(dark, 2, 2, 2), np.ones((1, 30), np.float32)
    seen[0, :15], depth[0, :15] = 30, 0.9
    light = dark.light(seen, depth)
    assert light is not None
    assert light.factor == pytest.approx((2, 2, 2), rel=0.02)
    depth[0, 15:] = np.nan
    assert dark.light(seen, depth) is None


def test_pixels_that_disagree_tell_nothing() -> None:
    dark = dark_pixels(GREY, GREY)
    seen = lit(dark, 2, 2, 2)
    seen[0, :10] = lit(dark, 1.5, 1.5, 1.5)[0, :10]
    assert dark.light(seen, np.ones((1, 20), np.float32)) is None


def test_places_are_found_by_their_position(renderer) -> None:
    spots = at_places(
        [DarkPlace((0.44, 0.1, 0.0), BLUE), DarkPlace((5.0, 0.0, 0.0), GREY)], renderer.view
    )
    assert len(spots.pixels) == 9
    middle = renderer.view.points(spots.pixels[4:5], spots.depth[4:5])[0]
    assert middle == pytest.approx((0.44, 0.1, 0.0), abs=0.005)
    assert (spots.taught == BLUE).all()


def test_the_background_gives_its_dark_pixels(renderer, catalogue) -> None:
    background = renderer.perception(catalogue).background
    dark = of_background(background)
    assert 100 < len(dark.pixels) < 1500
    assert not background.table.take(dark.pixels).any()
