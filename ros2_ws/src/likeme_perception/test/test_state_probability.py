"""Probabilities of the states, and settings that are refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from likeme_core.geometry import Polygon
from likeme_core.paper_world import RIGHT, WORLD
from likeme_core.regions import Regions
from likeme_perception.config import config_from
from likeme_perception.state_probability import certain, state_probability

REGIONS = WORLD.regions
BOX = ((0.27, -0.1), (0.61, -0.1), (0.61, 0.2), (0.27, 0.2))
ARROW = Polygon(((0.3, 0.0), (0.5, 0.0), (0.4, 0.1), (0.5, 0.2), (0.3, 0.2)))
POLYGONS = Regions(REGIONS.states[:2], (ARROW, None))


@given(
    st.floats(-1, 2),
    st.floats(-2, 2),
    st.floats(-0.3, 0.3),
    st.floats(1e-4, 0.2),
    st.sampled_from([REGIONS, POLYGONS]),
)
def test_probabilities_sum_to_one(
    x: float, y: float, z: float, sigma: float, regions: Regions
) -> None:
    p = state_probability(regions, (x, y, z), sigma)
    assert sum(p) == pytest.approx(1.0)
    assert all(0 <= q <= 1 for q in p)


@given(st.floats(0.28, 0.6), st.floats(-0.32, 0.32))
def test_with_a_precise_centroid_the_likeliest_state_follows_the_centroid_rule(
    x: float, y: float
) -> None:
    if abs(y) < 1e-3:
        return
    p = state_probability(REGIONS, (x, y, 0.0), 1e-4)
    assert p[REGIONS.state_of(x, y)] == max(p)


def test_on_the_blue_line_left_and_right_are_equally_likely() -> None:
    left, right, off = state_probability(REGIONS, (0.44, 0.0, 0.0), 0.005)
    assert left == pytest.approx(right)
    assert off < 1e-6


def test_unknown_is_uniform_and_known_is_certain() -> None:
    assert certain(None, REGIONS) == pytest.approx((1 / 3, 1 / 3, 1 / 3))
    assert certain(RIGHT, REGIONS) == (0.0, 1.0, 0.0)


@given(st.floats(0.0, 0.9), st.floats(-0.4, 0.5), st.floats(1e-3, 0.1))
def test_a_rectangle_as_a_polygon_has_the_same_probability(
    x: float, y: float, sigma: float
) -> None:
    box = Polygon(BOX)
    one, other = (
        state_probability(Regions(REGIONS.states[:2], (area, None)), (x, y, 0.0), sigma)
        for area in (box, box.bounds)
    )
    assert one == pytest.approx(other, abs=1e-9)


@pytest.mark.parametrize(
    ('x', 'y', 'sigma'), [(0.42, 0.1, 0.02), (0.3, 0.0, 0.05), (0.4, 0.1, 0.2)]
)
def test_the_probability_of_a_polygon_is_its_share_of_samples(
    x: float, y: float, sigma: float
) -> None:
    n = 200_000
    samples = np.random.default_rng(1).normal((x, y), sigma, (n, 2))
    share = ARROW.contains(*samples.T).mean()
    p = state_probability(POLYGONS, (x, y, 0.0), sigma)[0]
    assert p == pytest.approx(share, abs=4 * np.sqrt(0.25 / n))


def test_invalid_settings_are_refused() -> None:
    with pytest.raises(ValueError, match='x_min < x_max'):
        config_from({'table': [0.6, 0.3, -0.3, 0.3]})
    with pytest.raises(ValueError, match='table as 4 numbers, got 3'):
        config_from({'table': [0.6, 0.3, -0.3]})
    with pytest.raises(ValueError, match="got 'tabel'"):
        config_from({'tabel': [0, 1, 0, 1]})
    with pytest.raises(ValueError, match='human_sides among'):
        config_from({'human_sides': ['north']})
    with pytest.raises(ValueError, match='quaternion of length 1, got 2'):
        config_from({'camera_quaternion': (0.0, 0.0, 0.0, 2.0)}).camera_pose()
