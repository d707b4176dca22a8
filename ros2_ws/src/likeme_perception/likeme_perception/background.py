"""The empty scene, learned from the first frames: table plane, and what else stands still."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.geometry import Rectangle
from likeme_perception.config import PerceptionConfig
from likeme_perception.errors import NoTableError
from likeme_perception.plane import Plane, ransac_plane, refine_plane
from likeme_perception.rgbd import Intrinsics, RgbdFrame, deproject, depth_sigma
from likeme_perception.view import TableView, levelled, pose_from_plane

ImageF = NDArray[np.float32]
ImageB = NDArray[np.uint8]
Mask = NDArray[np.bool_]

# Depth that jumps this much (m) in more than this share of the pixels means that something moved.
_UNSTEADY_DEPTH = 0.05
_UNSTEADY_SHARE = 0.015


@dataclass(frozen=True, eq=False)
class Background:
    """The scene without things and hands, as the camera at rest sees it.

    nearest: (H, W) m; a reading nearer than this is foreground. table: pixels in which the plane
    itself is the background. colour: mean RGB, (H, W, 3).
    """

    view: TableView
    nearest: ImageF
    table: Mask
    colour: ImageB
    depth: ImageF
    area: Rectangle

    def foreground(self, frame: RgbdFrame) -> ImageB:
        """Pixels nearer than the background, without specks, (H, W) 0 or 1."""
        mask = (frame.depth < self.nearest).view(np.uint8)
        return cast(ImageB, cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)))


class BackgroundLearner:
    """Takes frames until it knows the background."""

    def __init__(self, config: PerceptionConfig, intrinsics: Intrinsics) -> None:
        self._config = config
        self._intrinsics = intrinsics
        self.restarts = 0
        self._clear()

    def _clear(self) -> None:
        shape = self._intrinsics.shape
        self.frames = 0
        self._count = np.zeros(shape, np.float32)
        self._sum = np.zeros(shape, np.float32)
        self._squares = np.zeros(shape, np.float32)
        self._colour = np.zeros((*shape, 3), np.float32)

    def add(self, frame: RgbdFrame) -> Background | None:
        """Take one frame; the background once there are enough of them and nothing moved.

        Raises:
            NoTableError: they show no table; learning begins anew.
        """
        seen = np.isfinite(frame.depth)
        depth = np.where(seen, frame.depth, np.float32(0))
        self._count += seen
        self._sum += depth
        self._squares += depth * depth
        cv2.accumulate(np.ascontiguousarray(frame.rgb), self._colour)
        self.frames += 1
        if self.frames < self._config.background_frames:
            return None
        mean, spread = self._statistics()
        if np.mean(spread > _UNSTEADY_DEPTH) > _UNSTEADY_SHARE:
            self.restarts += 1
            self._clear()
            return None
        colour = (self._colour / self.frames).astype(np.uint8)
        try:
            return learned_background(mean, spread, colour, self._config, self._intrinsics)
        except NoTableError:
            # What was seen so far is no table; with it in the mean there would never be one.
            self._clear()
            raise

    def _statistics(self) -> tuple[ImageF, ImageF]:
        """Mean and deviation of the depth; NaN where fewer than a fifth of the frames saw it."""
        count = np.where(self._count >= max(1.0, 0.2 * self.frames), self._count, np.nan)
        mean = self._sum / count
        spread = np.sqrt(np.maximum(self._squares / count - mean * mean, 0))
        return mean.astype(np.float32), spread.astype(np.float32)


def learned_background(
    depth: ImageF, spread: ImageF, colour: ImageB, config: PerceptionConfig, intrinsics: Intrinsics
) -> Background:
    """The background from the depth's mean and standard deviation and the mean colour."""
    view = find_table(depth, config, intrinsics)
    sigma = np.nan_to_num(depth_sigma(depth), nan=0.004)
    steepness = np.abs(view.slope)
    least = np.maximum(config.min_height, config.height_sigmas * sigma * steepness)
    on_table, area = _table_pixels(depth, view, config)
    structure, objects = _risen(depth, view, area, least)
    if config.empty_at_start:
        structure, objects = np.ones_like(on_table), np.zeros_like(on_table)
    elif config.table is None:
        # Nobody said where the table ends: what rises over its plane is a thing, not the scene.
        structure, objects = np.zeros_like(on_table), structure | objects
    plane_pixels = (on_table & ~structure) | objects
    jump = config.min_height if config.empty_at_start else 0.01
    margin = np.maximum(config.height_sigmas * sigma, jump) + 3 * np.nan_to_num(spread)
    nearest = np.where(plane_pixels, view.depth_at_height(least), _filled(depth) - margin)
    if config.table is None and not config.empty_at_start:
        nearest = np.where(on_table | objects, nearest, 0)
    return Background(view, nearest.astype(np.float32), on_table | objects, colour, depth, area)


def _filled(depth: ImageF) -> ImageF:
    """Depth with holes closed by the nearest surface around them; 0 where nothing is near."""
    high = np.nan_to_num(depth, nan=1e3).astype(np.float32)
    near = cv2.erode(high, np.ones((15, 15), np.uint8))
    filled = np.where(np.isnan(depth), near, depth)
    return np.where(filled > 100, 0, filled).astype(np.float32)


def find_table(depth: ImageF, config: PerceptionConfig, intrinsics: Intrinsics) -> TableView:
    """The camera's pose over the table: configured and levelled to the plane, or estimated."""
    rng = np.random.default_rng(0)
    cloud = deproject(depth, intrinsics)[::4, ::4]
    pose = config.camera_pose()
    if pose is None:
        return TableView(intrinsics, pose_from_plane(_table_among(cloud, rng)))
    points = cloud[np.isfinite(cloud[:, :, 2])].astype(np.float64)
    in_base = points @ pose[:3, :3].T + pose[:3, 3]
    near = np.abs(in_base[:, 2]) < 0.05
    if config.table is not None:
        near &= config.table.contains(in_base[:, 0], in_base[:, 1], -0.01)
    if near.sum() < 200:
        raise NoTableError(
            f'Expected the table at z = 0 in {config.reference_frame}, '
            f'got {int(near.sum())} points there: is the camera pose right?'
        )
    plane = ransac_plane(points[near], rng)
    return TableView(intrinsics, levelled(pose, refine_plane(points[near], plane, 0.01)))


def _table_among(cloud: ImageF, rng: np.random.Generator) -> Plane:
    """The largest plane, or, when that has little of the middle of the image, the largest there.

    A camera looks at its table: what lies at the rim of the image may be the floor.
    """
    rows, columns = cloud.shape[0] // 4, cloud.shape[1] // 4
    middle = cloud[rows:-rows, columns:-columns].reshape(-1, 3)
    middle = middle[np.isfinite(middle[:, 2])]
    largest, central = ransac_plane(cloud.reshape(-1, 3), rng), ransac_plane(middle, rng)
    share, best = (np.mean(np.abs(p.height(middle)) < 0.01) for p in (largest, central))
    return central if best > 3 * share else largest


def _table_pixels(
    depth: ImageF, view: TableView, config: PerceptionConfig
) -> tuple[Mask, Rectangle]:
    """Pixels whose ray meets the table, and the table's rectangle."""
    x, y = view.ground[:, :, 0], view.ground[:, :, 1]
    if config.table is not None:
        return config.table.contains(x, y), config.table
    with np.errstate(invalid='ignore'):
        flat = np.abs(depth / view.depth_at_height(0.0) - 1) < 0.02
    _, labels, stats, _ = cv2.connectedComponentsWithStats(flat.astype(np.uint8))
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    outline = np.argwhere(labels == largest)[:, ::-1].astype(np.int32)
    hull = np.zeros(depth.shape, np.uint8)
    cv2.fillConvexPoly(hull, cv2.convexHull(outline), (1,))
    inside = hull.astype(bool)
    corner = [np.percentile(v[inside], q) for v in (x, y) for q in (0.5, 99.5)]
    return inside, Rectangle(*(float(v) for v in corner))


def _risen(depth: ImageF, view: TableView, area: Rectangle, least: ImageF) -> tuple[Mask, Mask]:
    """What rises over the table at start, in two parts: standing structure, and objects.

    Structure reaches beyond the table (an arm at rest); an object lies within its rectangle, even
    where it hides what is behind the table.
    """
    height = depth * view.slope + view.origin[2]
    high = cv2.morphologyEx(
        (height > least).astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)
    )
    _, labels = cv2.connectedComponents(high)
    points = view.points(np.arange(depth.size), depth.ravel())
    outside = ~area.contains(points[:, 0], points[:, 1], 0.03).reshape(depth.shape) & (labels > 0)
    reaches_out = np.bincount(labels[outside], minlength=labels.max() + 1) > 30
    reaches_out[0] = False
    structure = cv2.dilate(reaches_out[labels].astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    return structure, (labels > 0) & ~reaches_out[labels]
