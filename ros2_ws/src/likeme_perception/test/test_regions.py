"""The centroid rule and its probabilities."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from likeme_core.geometry import Rectangle
from likeme_core.regions import Regions
from likeme_core.tabletop import State
from likeme_perception.config import PerceptionConfig, config_from
from likeme_perception.regions import certain, state_probability

AREA = Rectangle(0.27, 0.61, -0.33, 0.33)
REGIONS = Regions(AREA, 0.0)


@pytest.mark.parametrize(
    ('x', 'y', 'z', 'state'),
    [
        (0.4, 0.1, 0.03, State.LEFT),
        (0.4, -0.1, 0.03, State.RIGHT),
        (0.4, 0.0, 0.03, State.RIGHT),
        (0.4, 0.34, 0.03, State.OFFTABLE),
        (0.62, 0.1, 0.03, State.OFFTABLE),
        (0.26, -0.1, 0.03, State.OFFTABLE),
        (0.4, 0.1, -0.17, State.OFFTABLE),
    ],
)
def test_the_centroid_rule(x: float, y: float, z: float, state: State) -> None:
    assert REGIONS.state_of(x, y, z) is state


@given(
    st.floats(-1, 2),
    st.floats(-2, 2),
    st.floats(-0.3, 0.3),
    st.floats(1e-4, 0.2),
    st.floats(-1, 1),
)
def test_probabilities_sum_to_one(x: float, y: float, z: float, sigma: float, line: float) -> None:
    p = state_probability(Regions(AREA, line), (x, y, z), sigma)
    assert sum(p) == pytest.approx(1.0)
    assert all(0 <= q <= 1 for q in p)


@given(st.floats(0.28, 0.6), st.floats(-0.32, 0.32))
def test_with_a_sharp_centroid_the_likeliest_state_is_the_ruled_one(x: float, y: float) -> None:
    if abs(y) < 1e-3:
        return
    p = state_probability(REGIONS, (x, y, 0.0), 1e-4)
    assert p[REGIONS.state_of(x, y)] == max(p)


def test_on_the_line_both_halves_are_as_likely() -> None:
    left, right, off = state_probability(REGIONS, (0.44, 0.0, 0.0), 0.005)
    assert left == pytest.approx(right)
    assert off < 1e-6


def test_unknown_is_uniform_and_known_is_certain() -> None:
    assert certain(None) == pytest.approx((1 / 3, 1 / 3, 1 / 3))
    assert certain(State.RIGHT) == (0.0, 1.0, 0.0)


def test_settings_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ValueError, match='x_min < x_max'):
        config_from({'work_area': [0.6, 0.3, -0.3, 0.3]})
    with pytest.raises(ValueError, match='work_area as 4 numbers, got 3'):
        config_from({'work_area': [0.6, 0.3, -0.3]})
    with pytest.raises(ValueError, match="got 'wrok_area'"):
        config_from({'wrok_area': [0, 1, 0, 1]})
    with pytest.raises(ValueError, match='human_sides among'):
        config_from({'human_sides': ['north']})
    with pytest.raises(ValueError, match='quaternion of length 1, got 2'):
        PerceptionConfig(camera_quaternion=(0.0, 0.0, 0.0, 2.0)).camera_pose()
