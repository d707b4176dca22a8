"""Background model, learned from the first frames: table plane and static structure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.geometry import Rectangle
from likeme_perception.camera_view import CameraView
from likeme_perception.config import PerceptionConfig
from likeme_perception.entry_side import entry_sides
from likeme_perception.errors import NoTableError
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_sigma
from likeme_perception.table_detection import find_table, table_pixels

ImageF = NDArray[np.float32]
ImageB = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

# The scene moved if the depth deviates by more than this (m) in more than this share of pixels.
_UNSTEADY_DEPTH = 0.05
_UNSTEADY_SHARE = 0.015
# Edge (m) of the blocks of the table in which depth is looked for, less than an object's; and the
# share of readings from which a block is seen.
_BLOCK, _READ = 0.03, 0.25
# One pixel in so many of the bare table is looked at; so near (px) to its edge they do not count.
_EVERY, _EDGE = 17, 4

#: Points within this (m) of a plane lie on it.
ON_PLANE = 0.01


@dataclass(frozen=True, eq=False)
class Background:
    """The scene without objects, hands and arms, for a camera that does not move.

    nearest: (H, W) m; a smaller reading is foreground. table: pixels whose background is the table
    plane. colour: mean RGB, (H, W, 3). depth: mean, (H, W) m. area: the table top. covered: pixels
    of the table that something from beside it, a hand, hid: nothing was learned there. bare: depth
    below which a pixel of the table is foreground once it is uncovered, (H, W) m. top: `table` as
    it was learned, with what was covered since. roughness: robust standard deviation, m, of the
    bare table's height over its plane, by noise and distortion of the depth.
    """

    view: CameraView
    nearest: ImageF
    table: Mask
    colour: ImageB
    depth: ImageF
    area: Rectangle
    covered: Mask
    bare: ImageF
    top: Mask
    roughness: float = 0.0

    def foreground(self, frame: RgbdFrame) -> ImageB:
        """Foreground mask, morphologically opened, (H, W) 0 or 1."""
        mask = (frame.depth < self.nearest).view(np.uint8)
        return cast(ImageB, cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)))

    @cached_property
    def bare_pixels(self) -> Index:
        """Some of the pixels that showed the bare table, flat indices."""
        height = self.depth * self.view.slope + self.view.origin[2]
        bare = self.table & (np.abs(height) < ON_PLANE)
        inner = cv2.erode(bare.astype(np.uint8), np.ones((2 * _EDGE + 1,) * 2, np.uint8))
        return np.flatnonzero(inner)[::_EVERY]

    @cached_property
    def still(self) -> Mask:
        """Pixels that show nothing that lies on the table, (H, W)."""
        height = self.depth * self.view.slope + self.view.origin[2]
        return np.asarray(~(self.top & (height > ON_PLANE)) & ~self.covered)

    @cached_property
    def _table_blocks(self) -> Mask:
        """Blocks of the image that show the table and were read when it was learned."""
        read = _block_means(np.isfinite(self.depth), self._block)
        return (_block_means(self.top, self._block) > 0.9) & (read > _READ)

    @cached_property
    def _block(self) -> int:
        """Edge of a block, pixels."""
        distance = float(np.nanmedian(self.depth[self.table])) if self.table.any() else 1.0
        return max(1, round(_BLOCK * self.view.intrinsics.fx / distance))

    def table_seen(self, frame: RgbdFrame, absorbed: ImageB) -> bool:
        """Whether all of the table has depth, so that no object on it can be missed.

        absorbed: pixels (H, W) of still hands and arms, which hide it.
        """
        # A comparison with NaN is False.
        read = frame.depth > 0
        if absorbed.any():
            read &= absorbed == 0
        return not bool((self._table_blocks & (_block_means(read, self._block) < _READ)).any())


def _block_means(mask: Mask, edge: int) -> ImageF:
    """Share of a mask (H, W) in each block of some pixels' edge."""
    size = max(mask.shape[1] // edge, 1), max(mask.shape[0] // edge, 1)
    blocks = cv2.resize(mask.view(np.uint8) * np.uint8(255), size, interpolation=cv2.INTER_AREA)
    return np.asarray(blocks, np.float32) / np.float32(255)


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
        if np.mean(_wide(spread > _UNSTEADY_DEPTH)) > _UNSTEADY_SHARE:
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
    bare = view.depth_at_height(least)
    nearest = np.where(plane_pixels, bare, _filled(depth) - margin)
    if config.table is None and not config.empty_at_start:
        nearest = np.where(on_table | objects, nearest, 0)
    covered = _covered(structure, on_table, depth, view, config, area)
    table = on_table | objects
    return Background(
        view, nearest.astype(np.float32), table, colour, depth, area, covered, bare, table,
        _roughness(depth, view, table & (depth > bare)),
    )  # fmt: skip


def _roughness(depth: ImageF, view: CameraView, bare: Mask) -> float:
    """Robust standard deviation of the height, m, of the pixels of the bare table (H, W)."""
    height = (depth * view.slope + view.origin[2])[bare]
    if len(height) == 0:
        return 0.0
    return 1.4826 * float(np.median(np.abs(height - np.median(height))))


def _wide(mask: Mask) -> Mask:
    """The mask without what is narrow: noise of the depth along edges."""
    return cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)) > 0


def _covered(
    structure: Mask,
    on_table: Mask,
    depth: ImageF,
    view: CameraView,
    config: PerceptionConfig,
    area: Rectangle,
) -> Mask:
    """Pixels of the table under what reaches in from a person's side, (H, W)."""
    covered = np.zeros_like(on_table)
    if config.empty_at_start:
        return covered
    _, labels = cv2.connectedComponents(structure.astype(np.uint8))
    for label in np.unique(labels[structure & on_table]):
        pixels = np.flatnonzero((labels == label) & np.isfinite(depth))
        z = depth.ravel()[pixels]
        xyz, seen = view.points(pixels, z).T, view.pixel_area(z)
        if entry_sides(xyz, seen, area, -config.fallen_depth, config.human_sides):
            covered |= (labels == label) & on_table
    return covered


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
