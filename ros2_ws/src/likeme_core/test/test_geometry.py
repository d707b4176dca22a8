"""Rectangles, regions and the table."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_core.geometry import Rectangle
from likeme_core.regions import Regions
from likeme_core.table import Table
from likeme_core.tabletop import State

AREA = Rectangle(0.27, 0.61, -0.33, 0.33)


def test_a_rectangle_contains_its_edges_and_a_margin() -> None:
    assert AREA.contains(0.27, 0.33)
    assert not AREA.contains(0.269, 0.0)
    assert AREA.contains(0.269, 0.0, margin=0.002)
    assert not AREA.contains(0.28, 0.0, margin=-0.02)


def test_a_rectangle_tests_arrays_of_points() -> None:
    x, y = np.array([0.4, 0.7, 0.4]), np.array([0.0, 0.0, -0.4])
    np.testing.assert_array_equal(AREA.contains(x, y), [True, False, False])


def test_centre_and_corners_of_a_rectangle() -> None:
    assert AREA.centre == pytest.approx((0.44, 0.0))
    corners = AREA.corners()
    assert corners.shape == (4, 2)
    np.testing.assert_allclose(corners.mean(axis=0), AREA.centre)
    # In order around the area: successive corners share one coordinate.
    assert all((a == b).sum() == 1 for a, b in zip(corners, np.roll(corners, -1, 0), strict=True))


@pytest.mark.parametrize('limits', [(0.6, 0.3, 0.0, 1.0), (0.0, 1.0, 0.2, 0.2)])
def test_an_empty_rectangle_is_refused(limits: tuple[float, float, float, float]) -> None:
    with pytest.raises(ValueError, match=f'x_min < x_max and y_min < y_max, got x {limits[0]:g}'):
        Rectangle(*limits)


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
        (0.4, 0.1, -0.029, State.LEFT),
    ],
)
def test_the_centroid_rule(x: float, y: float, z: float, state: State) -> None:
    assert Regions(AREA, 0.0).state_of(x, y, z) is state
    assert Table().state_of(x, y, z) is state


def test_the_blue_line_can_be_moved() -> None:
    assert Regions(AREA, 0.15).state_of(0.4, 0.1) is State.RIGHT


def test_the_regions_of_a_table_have_its_dimensions() -> None:
    table = Table(blue_line_y=0.05, thickness=0.04)
    assert table.regions == Regions(table.work_area, 0.05, 0.04)
