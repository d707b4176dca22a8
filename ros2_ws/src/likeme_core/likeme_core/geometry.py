"""Areas of the table plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, overload

import numpy as np
import shapely
from numpy.typing import NDArray


@dataclass(frozen=True)
class Rectangle:
    """An axis-aligned area of the table plane, m, in base_link."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float

    def __post_init__(self) -> None:
        if not (self.x_min < self.x_max and self.y_min < self.y_max):
            raise ValueError(
                f'Expected x_min < x_max and y_min < y_max, '
                f'got x {self.x_min:g} to {self.x_max:g} '
                f'and y {self.y_min:g} to {self.y_max:g}.'
            )

    @overload
    def contains(self, x: float, y: float, margin: float = 0.0) -> bool: ...

    @overload
    def contains(
        self, x: NDArray[np.floating], y: NDArray[np.floating], margin: float = 0.0
    ) -> NDArray[np.bool_]: ...

    def contains(
        self, x: float | NDArray[np.floating], y: float | NDArray[np.floating], margin: float = 0.0
    ) -> bool | NDArray[np.bool_]:
        """Whether points lie inside the area extended by a margin (m), edges included."""
        return (
            (x >= self.x_min - margin)
            & (x <= self.x_max + margin)
            & (y >= self.y_min - margin)
            & (y <= self.y_max + margin)
        )

    @property
    def centre(self) -> tuple[float, float]:
        """The centre, (x, y)."""
        return (self.x_min + self.x_max) / 2, (self.y_min + self.y_max) / 2

    def corners(self) -> NDArray[np.float64]:
        """The four corners in order around the area, (4, 2)."""
        x0, x1, y0, y1 = self.x_min, self.x_max, self.y_min, self.y_max
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])

    @property
    def bounds(self) -> Rectangle:
        """The smallest rectangle around the area: the area itself."""
        return self


@dataclass(frozen=True)
class Polygon:
    """An area of the table plane without holes, by its vertices in order around it, m."""

    vertices: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if len(self.vertices) < 3:
            raise ValueError(f'Expected 3 vertices or more, got {len(self.vertices)}.')
        if not self.shape.is_valid:
            reason = shapely.is_valid_reason(self.shape)
            raise ValueError(f'Expected sides that do not cross or touch, got: {reason}.')

    @cached_property
    def shape(self) -> shapely.Polygon:
        """The area as shapely's polygon."""
        polygon = shapely.Polygon(self.vertices)
        shapely.prepare(polygon)
        return polygon

    @overload
    def contains(self, x: float, y: float, margin: float = 0.0) -> bool: ...

    @overload
    def contains(
        self, x: NDArray[np.floating], y: NDArray[np.floating], margin: float = 0.0
    ) -> NDArray[np.bool_]: ...

    def contains(
        self, x: float | NDArray[np.floating], y: float | NDArray[np.floating], margin: float = 0.0
    ) -> bool | NDArray[np.bool_]:
        """Whether points lie inside the area extended by a margin (m), edges included."""
        # Mitred, so that the corners stay corners as those of a rectangle do.
        area = self.shape.buffer(margin, join_style='mitre') if margin else self.shape
        found: Any = shapely.intersects_xy(area, x, y)
        return found if np.ndim(found) else bool(found)

    @property
    def centre(self) -> tuple[float, float]:
        """The centroid, or a point inside if that lies outside, (x, y)."""
        point = self.shape.centroid
        if not self.shape.contains(point):
            point = self.shape.representative_point()
        return float(point.x), float(point.y)

    @property
    def bounds(self) -> Rectangle:
        """The smallest axis-aligned rectangle around the area."""
        x_min, y_min, x_max, y_max = map(float, self.shape.bounds)
        return Rectangle(x_min, x_max, y_min, y_max)

    def corners(self) -> NDArray[np.float64]:
        """The vertices in order around the area, (V, 2)."""
        return np.array(self.vertices, float)


#: Where a region lies on the table plane.
Area = Rectangle | Polygon


def overlap(first: Area, second: Area) -> float:
    """Size of the area that two areas share, m^2."""
    shared = _shape(first).intersection(_shape(second))
    return float(shared.area)


def covers(outer: Rectangle, inner: Area) -> bool:
    """Whether an area lies within a rectangle, edges included."""
    return bool(np.all(outer.contains(*inner.corners().T)))


def distance(area: Area, x: float, y: float) -> float:
    """Distance of a point from an area, m; 0 inside."""
    return float(_shape(area).distance(shapely.Point(x, y)))


def border_distance(areas: Sequence[Area], x: float, y: float) -> float:
    """Distance of a point from the border of what some areas cover together, m."""
    border = shapely.union_all([_shape(area) for area in areas]).boundary
    return float(border.distance(shapely.Point(x, y)))


def _shape(area: Area) -> shapely.Polygon:
    return area.shape if isinstance(area, Polygon) else shapely.Polygon(area.corners())
