"""Background model, learned from the first frames: table plane and static structure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.geometry import Rectangle
from likeme_perception.camera_view import CameraView
from likeme_perception.config import PerceptionConfig
from likeme_perception.errors import NoTableError
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_sigma
from likeme_perception.table_detection import find_table, table_pixels

ImageF = NDArray[np.float32]
ImageB = NDArray[np.uint8]
Mask = NDArray[np.bool_]

# The scene moved if the depth deviates by more than this (m) in more than this share of pixels.
_UNSTEADY_DEPTH = 0.05
_UNSTEADY_SHARE = 0.015


@dataclass(frozen=True, eq=False)
class Background:
    """The scene without objects, hands and arms, for a camera that does not move.

    nearest: (H, W) m; a smaller reading is foreground. table: pixels whose background is the table
    plane. colour: mean RGB, (H, W, 3). depth: mean, (H, W) m. area: the table top.
    """

    view: CameraView
    nearest: ImageF
    table: Mask
    colour: ImageB
    depth: ImageF
    area: Rectangle

    def foreground(self, frame: RgbdFrame) -> ImageB:
        """Foreground mask, morphologically opened, (H, W) 0 or 1."""
        mask = (frame.depth < self.nearest).view(np.uint8)
        return cast(ImageB, cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)))


class BackgroundLearner:
    """Accumulates frames until the background can be computed."""

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
        """Add one frame; the background, once there are enough frames without motion.

        Raises:
            NoTableError: the frames show no table; learning starts again.
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
            # Frames without a table would spoil the mean of those that show it later.
            self._clear()
            raise

    def _statistics(self) -> tuple[ImageF, ImageF]:
        """Mean and deviation of the depth; NaN with readings in less than 1/5 of the frames."""
        count = np.where(self._count >= max(1.0, 0.2 * self.frames), self._count, np.nan)
        mean = self._sum / count
        spread = np.sqrt(np.maximum(self._squares / count - mean * mean, 0))
        return mean.astype(np.float32), spread.astype(np.float32)


def learned_background(
    depth: ImageF, spread: ImageF, colour: ImageB, config: PerceptionConfig, intrinsics: Intrinsics
) -> Background:
    """The background from mean and standard deviation of the depth and the mean colour."""
    view = find_table(depth, config, intrinsics)
    sigma = np.nan_to_num(depth_sigma(depth), nan=0.004)
    steepness = np.abs(view.slope)
    least = np.maximum(config.min_height, config.height_sigmas * sigma * steepness)
    on_table, area = table_pixels(depth, view, config)
    structure, objects = _above_table(depth, view, area, least)
    if config.empty_at_start:
        structure, objects = np.ones_like(on_table), np.zeros_like(on_table)
    elif config.table is None:
        # The table's edges are not known: treat everything above its plane as an object.
        structure, objects = np.zeros_like(on_table), structure | objects
    plane_pixels = (on_table & ~structure) | objects
    jump = config.min_height if config.empty_at_start else 0.01
    margin = np.maximum(config.height_sigmas * sigma, jump) + 3 * np.nan_to_num(spread)
    nearest = np.where(plane_pixels, view.depth_at_height(least), _filled(depth) - margin)
    if config.table is None and not config.empty_at_start:
        nearest = np.where(on_table | objects, nearest, 0)
    return Background(view, nearest.astype(np.float32), on_table | objects, colour, depth, area)


def _filled(depth: ImageF) -> ImageF:
    """Depth with holes filled by the nearest surface around them; 0 where there is none."""
    high = np.nan_to_num(depth, nan=1e3).astype(np.float32)
    near = cv2.erode(high, np.ones((15, 15), np.uint8))
    filled = np.where(np.isnan(depth), near, depth)
    return np.where(filled > 100, 0, filled).astype(np.float32)


def _above_table(
    depth: ImageF, view: CameraView, area: Rectangle, least: ImageF
) -> tuple[Mask, Mask]:
    """Masks of what stands above the table plane at the start: static structure, and objects.

    Structure extends beyond the table (an arm at rest); an object lies within its rectangle.
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
