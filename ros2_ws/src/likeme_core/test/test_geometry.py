"""Rectangles, regions and the table."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_core.geometry import Polygon, Rectangle, overlap
from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
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
        (0.4, 0.1, 0.03, LEFT),
        (0.4, -0.1, 0.03, RIGHT),
        (0.4, 0.0, 0.03, RIGHT),
        (0.4, 0.34, 0.03, OFFTABLE),
        (0.62, 0.1, 0.03, OFFTABLE),
        (0.26, -0.1, 0.03, OFFTABLE),
        (0.4, 0.1, -0.17, OFFTABLE),
        (0.4, 0.1, -0.029, LEFT),
    ],
)
def test_the_centroid_rule(x: float, y: float, z: float, state: State) -> None:
    assert WORLD.regions.state_of(x, y, z) == state


def test_the_work_area_is_around_all_areas() -> None:
    assert WORLD.regions.work_area == AREA


ARROW = Polygon(((0.0, 0.0), (0.4, 0.0), (0.2, 0.2), (0.4, 0.4), (0.0, 0.4)))


def test_a_polygon_contains_its_edges_and_a_margin() -> None:
    assert ARROW.contains(0.1, 0.2)
    assert ARROW.contains(0.3, 0.0)
    assert not ARROW.contains(0.3, 0.2)
    assert ARROW.contains(0.3, -0.01, margin=0.02)
    assert not ARROW.contains(0.3, 0.01, margin=-0.02)
    inside = ARROW.contains(np.array([0.1, 0.3]), np.array([0.2, 0.2]))
    np.testing.assert_array_equal(inside, [True, False])


def test_the_centre_of_a_polygon_is_inside() -> None:
    thin = Polygon(((0.0, 0.0), (1.0, 0.0), (1.0, 0.1), (0.1, 0.1), (0.1, 1.0), (0.0, 1.0)))
    assert thin.contains(*thin.centre)
    assert ARROW.bounds == Rectangle(0.0, 0.4, 0.0, 0.4)


@pytest.mark.parametrize(
    ('vertices', 'said'),
    [
        (((0, 0), (1, 0)), '3 vertices or more, got 2'),
        (((0, 0), (1, 1), (1, 0), (0, 1)), 'sides that do not cross'),
        (((0, 0), (1, 0), (2, 0)), 'sides that do not cross'),
    ],
)
def test_a_polygon_that_is_none_is_refused(
    vertices: tuple[tuple[float, float], ...], said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        Polygon(vertices)


def test_areas_that_share_a_border_do_not_overlap() -> None:
    left, right = Rectangle(0, 1, 0, 1), Rectangle(0, 1, -1, 0)
    assert overlap(left, right) == 0.0
    assert overlap(left, Rectangle(0.5, 2, 0.5, 2)) == pytest.approx(0.25)
    assert overlap(ARROW, Rectangle(0.0, 0.1, 0.0, 0.1)) == pytest.approx(0.01)
