"""Foreground pixels to blobs: connected regions, their points, and their shape seen from above."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.camera_view import TableView
from likeme_perception.colour import Bins, colour_bins
from likeme_perception.rgbd import RgbdFrame

ImageF = NDArray[np.float32]
ImageB = NDArray[np.uint8]
Index = NDArray[np.intp]

# Incidence (rad) beyond which a structured-light camera mostly has no reading; fits a Kinect's
# frames.
_STEEPEST = float(np.radians(65.0))


@dataclass(frozen=True, eq=False)
class Blob:
    """Pixels that belong together.

    pixels: flat indices (N,). points: (N, 3) m, reference frame. bins: of their colours (N,).
    area: seen surface, m^2.
    """

    pixels: Index
    points: ImageF
    bins: Bins
    area: float

    @cached_property
    def xyz(self) -> ImageF:
        """The points' x, y and z, each contiguous, (3, N) m."""
        return np.ascontiguousarray(self.points.T)

    @property
    def extent(self) -> float:
        """Greatest length along x or y, m."""
        return float(np.ptp(self.xyz[:2], axis=1).max())

    def part(self, chosen: NDArray[np.bool_]) -> Blob:
        """The blob of some of the pixels, their area in proportion."""
        at = np.flatnonzero(chosen)
        share = len(at) / max(len(self.pixels), 1)
        return Blob(
            self.pixels[at], self.points.take(at, axis=0), self.bins[at], self.area * share
        )


@dataclass(frozen=True)
class Shape:
    """A blob seen from above: centroid and axes, m and rad.

    centroid: middle of the covered cells and mean height. yaw: of the major axis, in (-pi/2,
    pi/2].
    """

    centroid: tuple[float, float, float]
    yaw: float
    length: float
    width: float
    height: float


def blobs_of(regions: list[Index], frame: RgbdFrame, view: TableView) -> list[Blob]:
    """A blob of each region (flat indices) of pixels that all have a depth reading."""
    if not regions:
        return []
    pixels = np.concatenate(regions)
    z = frame.depth.take(pixels)
    points, bins = view.points(pixels, z), colour_bins(frame.rgb, pixels)
    area = view.pixel_area(z)
    ends = np.cumsum([len(region) for region in regions])
    return [
        Blob(pixels[a:b], points[a:b], bins[a:b], float(area[a:b].sum()))
        for a, b in zip([0, *ends[:-1]], ends, strict=True)
    ]


def merged(blobs: list[Blob]) -> Blob:
    """One blob of several, or of none."""
    if not blobs:
        none = np.zeros(0, np.intp)
        return Blob(none, np.zeros((0, 3), np.float32), none.astype(np.int32), 0.0)
    if len(blobs) == 1:
        return blobs[0]
    return Blob(
        np.concatenate([b.pixels for b in blobs]),
        np.concatenate([b.points for b in blobs]),
        np.concatenate([b.bins for b in blobs]),
        sum(b.area for b in blobs),
    )


def image_components(mask: ImageB, least_pixels: int = 12) -> list[Index]:
    """Flat pixel indices of each 8-connected region of a mask, largest first."""
    _, top, _, high = cv2.boundingRect(mask)
    band = mask[top : top + high]
    inside = np.flatnonzero(band > 0)
    if len(inside) == 0:
        return []
    # Sorting the pixels by label costs less than the statistics OpenCV would give of each region.
    label = cv2.connectedComponents(band, connectivity=8)[1].take(inside)
    ordered = inside[np.argsort(label, kind='stable')] + top * mask.shape[1]
    regions = np.split(ordered, np.cumsum(np.bincount(label))[:-1])
    return sorted((r for r in regions if len(r) >= least_pixels), key=len, reverse=True)


def rows_and_columns(pixels: Index, width: int) -> tuple[Index, Index]:
    """Rows and columns of flat pixel indices; np.divmod takes much longer for the same."""
    rows = pixels // width
    return rows, pixels - rows * width


def _cells(blob: Blob, size: float) -> tuple[NDArray[np.int64], tuple[int, int]]:
    """Flat top-view cell of each point and the grid's shape."""
    x, y = (((v - v.min()) / size).astype(np.int64) for v in blob.xyz[:2])
    shape = int(x.max()) + 1, int(y.max()) + 1
    return x * shape[1] + y, shape


def top_view_parts(blob: Blob, cell_size: float, least_area: float = 0.0) -> list[Blob]:
    """Split a blob into what is connected seen from above: a thing hides no other there.

    Two things that touch only in the image, one behind the other, come apart.
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
    """Centroid and principal axes over the covered top-view cells.

    Every covered cell counts once, so that a side which faces the camera does not pull the
    centroid.
    """
    cell, shape = _cells(blob, cell_size)
    count = np.bincount(cell, minlength=shape[0] * shape[1])
    covered = np.flatnonzero(count)
    xy = np.stack(
        [np.bincount(cell, v, len(count))[covered] / count[covered] for v in blob.xyz[:2]],
        axis=1,
    )
    centre = xy.mean(axis=0)
    spread = (xy - centre).T @ (xy - centre) / len(xy) + np.eye(2) * cell_size**2 / 12
    axes = np.linalg.eigh(spread)[1]
    major = axes[:, 1]
    some = blob.points[:: max(1, len(blob.points) // 500)]
    along, across = (some[:, :2] - centre) @ major, (some[:, :2] - centre) @ axes[:, 0]
    # One in a hundred points at either end is noise; what it cuts off is about a cell.
    low, high = np.percentile([along, across], [1, 99], axis=1)
    length, width = (float(v) for v in high - low)
    yaw = float(np.arctan2(major[1], major[0]))
    yaw = yaw - np.pi if yaw > np.pi / 2 else yaw + np.pi if yaw <= -np.pi / 2 else yaw
    return Shape(
        (float(centre[0]), float(centre[1]), float(blob.xyz[2].mean())),
        yaw,
        max(length, width),
        min(length, width),
        float(np.percentile(some[:, 2], 99)),
    )


def completed(shape: Shape, camera: ImageF) -> Shape:
    """The shape with its centroid moved by what a round thing hides of itself.

    A ball of radius r seen at angle t from the vertical shows its plan from -r sin(q - t) on the
    far side to r min(1, sin(q + t)) on the near side, where q is the steepest incidence that is
    read. camera: the camera's position, m.
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


def mask_of(pixels: Index, shape: tuple[int, int]) -> ImageB:
    """An image (H, W) of 0 and 1 from flat pixel indices."""
    mask = np.zeros(shape[0] * shape[1], np.uint8)
    mask[pixels] = 1
    return cast(ImageB, mask.reshape(shape))
