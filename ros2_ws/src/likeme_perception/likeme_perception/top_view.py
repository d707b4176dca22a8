"""Blobs seen from above: connected components, centroid and principal axes on a grid of cells."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.blobs import Blob, ImageF

# Incidence angle (rad) beyond which a Kinect mostly has no reading; fitted to its frames.
_STEEPEST = float(np.radians(65.0))
# From this ratio of width to length on the principal axes do not tell how an object lies: those of
# a cube are anywhere. Its sides are looked for in so many directions of a quarter turn.
_SQUARE, _DIRECTIONS = 0.85, 30
# It has sides if the largest rectangle around it has so many times the area of the smallest: of a
# square it has twice, of a disc once.
_SIDED = 1.4


@dataclass(frozen=True)
class Shape:
    """Top view of a blob: centroid and principal axes, m and rad.

    centroid: x and y over the occupied cells, mean z. yaw: of the major axis, in (-pi/2, pi/2]; of
    the longer side where it is about as wide as it is long.
    """

    centroid: tuple[float, float, float]
    yaw: float
    length: float
    width: float
    height: float


def _cells(blob: Blob, size: float) -> tuple[NDArray[np.int64], tuple[int, int]]:
    """Flat grid cell of each point, and the grid's shape."""
    x, y = (((v - v.min()) / size).astype(np.int64) for v in blob.xyz[:2])
    shape = int(x.max()) + 1, int(y.max()) + 1
    return x * shape[1] + y, shape


def top_view_parts(blob: Blob, cell_size: float, least_area: float = 0.0) -> list[Blob]:
    """Split a blob into its connected components on the top-view grid.

    This separates objects that overlap in the image only, one behind the other.
    """
    if len(blob.pixels) == 0:
        return []
    cell, shape = _cells(blob, cell_size)
    if shape[0] * shape[1] > 4_000_000:
        return [blob]
    count = np.bincount(cell, minlength=shape[0] * shape[1]).reshape(shape)
    _, labels = cv2.connectedComponents((count > 0).astype(np.uint8), connectivity=8)
    label = labels.ravel()[cell]
    if label.max() <= 1:
        return [blob] if blob.area >= least_area else []
    parts = [blob.part(label == k) for k in range(1, label.max() + 1)]
    return [p for p in parts if p.area >= least_area]


def shape_of(blob: Blob, cell_size: float = 0.005) -> Shape:
    """Centroid and principal axes over the occupied cells.

    Every cell has the same weight, so that the denser points of the side that faces the camera do
    not bias the centroid.
    """
    cell, shape = _cells(blob, cell_size)
    count = np.bincount(cell, minlength=shape[0] * shape[1])
    covered = np.flatnonzero(count)
    xy = np.stack(
        [np.bincount(cell, v, len(count))[covered] / count[covered] for v in blob.xyz[:2]], axis=1
    )
    centre = xy.mean(axis=0)
    spread = (xy - centre).T @ (xy - centre) / len(xy) + np.eye(2) * cell_size**2 / 12
    axes = np.linalg.eigh(spread)[1]
    major = axes[:, 1]
    some = blob.points[:: max(1, len(blob.points) // 500)]
    along, across = (some[:, :2] - centre) @ major, (some[:, :2] - centre) @ axes[:, 0]
    # Percentiles, because single outliers would lengthen the axes; this trims about one cell.
    length, width = (
        _percentile(v, 0.99) - _percentile(v, 0.01) for v in (np.sort(along), np.sort(across))
    )
    yaw = float(np.arctan2(major[1], major[0]))
    if min(length, width) > _SQUARE * max(length, width):
        side = _side(some[:, :2] - centre)
        yaw = yaw if side is None else side
    yaw = yaw - np.pi if yaw > np.pi / 2 else yaw + np.pi if yaw <= -np.pi / 2 else yaw
    return Shape(
        (float(centre[0]), float(centre[1]), float(blob.xyz[2].mean())),
        yaw,
        max(length, width),
        min(length, width),
        _percentile(np.sort(some[:, 2]), 0.99),
    )


def _side(xy: NDArray[np.float64]) -> float | None:
    """Direction (rad) of the longer side of the smallest rectangle around points (N, 2).

    None: it has no sides.
    """
    angles = np.arange(2 * _DIRECTIONS) * (np.pi / 2 / _DIRECTIONS)
    along = np.sort(xy @ np.stack([np.cos(angles), np.sin(angles)]), axis=0)
    trimmed = len(xy) // 100
    extent = along[len(xy) - 1 - trimmed] - along[trimmed]
    first, second = extent[:_DIRECTIONS], extent[_DIRECTIONS:]
    area = first * second
    best = int(area.argmin())
    if area.max() < _SIDED * area[best]:
        return None
    return float(angles[best if first[best] >= second[best] else best + _DIRECTIONS])


def _percentile(ordered: NDArray[np.floating], share: float) -> float:
    """The same as np.percentile, of values in order; that takes 0.1 ms for so few."""
    at = share * (len(ordered) - 1)
    low, t = int(at), at - int(at)
    a, b = ordered[low], ordered[min(low + 1, len(ordered) - 1)]
    return float(a + (b - a) * t if t < 0.5 else b - (b - a) * (1 - t))


def correct_self_occlusion(shape: Shape, camera: ImageF) -> Shape:
    """The shape with its centroid corrected for the self-occlusion of a round object.

    Of a sphere of radius r, seen at angle t from the vertical, the camera measures the part from
    -r sin(q - t) on the far side to r min(1, sin(q + t)) on the near side, where q is the largest
    incidence angle with a reading. camera: its position, m.
    """
    x, y, z = shape.centroid
    away = np.array([x - camera[0], y - camera[1]])
    distance = float(np.hypot(*away))
    if distance < 1e-6:
        return shape
    t = float(np.arctan2(distance, max(camera[2] - shape.height / 2, 1e-6)))
    near = 1.0 if t + _STEEPEST > np.pi / 2 else float(np.sin(_STEEPEST + t))
    radius = min(max(shape.height, 0.0), shape.length) / 2
    shift = radius * (near - float(np.sin(_STEEPEST - t))) / 2
    dx, dy = (float(v) for v in shift * away / distance)
    return replace(shape, centroid=(x + dx, y + dy, z))
