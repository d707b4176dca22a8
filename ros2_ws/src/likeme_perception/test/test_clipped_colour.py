"""Colours of objects where the camera saturates."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from likeme_core.paper_world import WORLD
from likeme_perception.catalogue import ClippedCatalogue, world_catalogue
from likeme_perception.clipped_colour import clipped_log_density
from likeme_perception.colour import (
    FLOOR_LOG_DENSITY,
    UNKNOWN_LOG_DENSITY,
    ColourComponent,
    bins_of_lab,
)

NO_CAPS = (255, 255, 255)


def bin_of(*rgb: float) -> int:
    """The bin of a colour."""
    colour = np.array([[rgb]], np.float32).round().astype(np.uint8)
    return int(bins_of_lab(cv2.cvtColor(colour, cv2.COLOR_RGB2LAB)[0])[0])


def mixture(*rgb: int) -> tuple[ColourComponent, ...]:
    """One component about a colour."""
    colour = np.array([[rgb]], np.float32) / np.float32(255)
    l_, a, b = (float(v) for v in cv2.cvtColor(colour, cv2.COLOR_RGB2LAB)[0, 0])
    return (ColourComponent(1.0, (l_, a, b), (8.0, 3.0, 3.0)),)


def test_without_caps_it_is_the_density_of_the_mixture() -> None:
    known = world_catalogue(WORLD)
    usual = known.log_density
    same = clipped_log_density([o.colour for o in known.objects], NO_CAPS)
    # Bins of colours that no RGB image can have are never seen.
    seen = (same > FLOOR_LOG_DENSITY).any(axis=0)
    for one, other in zip(same, usual, strict=True):
        likely = (other > UNKNOWN_LOG_DENSITY + 1) & seen
        # The mass that no RGB image can have is left out.
        share = np.median((one - other)[likely])
        assert 0 < share < 1
        assert np.abs(one - other - share)[likely].mean() < 0.3


def test_colours_that_are_cut_off_to_the_same_are_equally_likely() -> None:
    red, crimson, blue = clipped_log_density(
        [mixture(200, 60, 60), mixture(160, 60, 60), mixture(60, 60, 160)], (90, 90, 90)
    )
    seen = bin_of(90, 60, 60)
    assert red[seen] == pytest.approx(crimson[seen], abs=0.5)
    assert blue[seen] < red[seen] - 3


def test_an_unknown_colour_is_cut_off_too() -> None:
    one = clipped_log_density([mixture(200, 200, 200)], (100, 100, 100))[0]
    free = clipped_log_density([mixture(200, 200, 200)], NO_CAPS)[0]
    # White is what every bright colour becomes.
    assert one[bin_of(100, 100, 100)] < free[bin_of(200, 200, 200)] - 1


def test_a_clipped_catalogue_has_the_objects_and_sizes_of_the_other() -> None:
    known = world_catalogue(WORLD)
    clipped = ClippedCatalogue(known.objects, (128, 128, 128))
    names = [o.name for o in clipped.objects]
    # Under twice the light the chicken is orange; pear and lemon are both yellow.
    assert names[int(clipped.likeliest[bin_of(128, 96, 41)])] == 'chicken'
    yellow = clipped.log_density[:, bin_of(128, 128, 40)]
    pear, lemon, chicken = (float(yellow[names.index(n)]) for n in ('pear', 'lemon', 'chicken'))
    assert abs(pear - lemon) < 2 < min(pear, lemon) - chicken
    assert (clipped.lengths == known.lengths).all()
