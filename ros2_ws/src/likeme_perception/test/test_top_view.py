"""How an object lies, seen from above."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_perception.blobs import Blob
from likeme_perception.top_view import shape_of


def box(length: float, width: float, yaw: float) -> Blob:
    """1,000 points of the top of a box (m, rad), with noise of 0.5 mm."""
    rng = np.random.default_rng(3)
    flat = rng.uniform(-0.5, 0.5, (1000, 2)) * (length, width)
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    xy = flat @ turn.T + rng.normal(0, 0.0005, flat.shape) + (0.4, 0.1)
    points = np.column_stack([xy, np.full(len(xy), 0.05)]).astype(np.float32)
    numbers = np.arange(len(xy))
    return Blob(numbers, points, numbers.astype(np.int32), length * width)


@pytest.mark.parametrize('degrees', range(-80, 91, 17))
def test_a_cube_lies_as_its_sides(degrees: int) -> None:
    found = shape_of(box(0.05, 0.05, np.radians(degrees)))

    off = (np.degrees(found.yaw) - degrees + 45) % 90 - 45
    assert abs(off) < 4


@pytest.mark.parametrize('degrees', range(-80, 91, 17))
def test_an_elongated_box_lies_as_its_long_side(degrees: int) -> None:
    found = shape_of(box(0.08, 0.05, np.radians(degrees)))

    off = (np.degrees(found.yaw) - degrees + 90) % 180 - 90
    assert abs(off) < 4
    assert -np.pi / 2 < found.yaw <= np.pi / 2
