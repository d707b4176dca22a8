"""Hands and arms that do not move: absorbed into the background until they move again."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.stamps import nanoseconds
from likeme_perception.background import Background
from likeme_perception.blobs import Index, mask_of
from likeme_perception.rgbd import RgbdFrame

ImageF = NDArray[np.float32]

# s after which something large is background that no hand or arm reaches in to.
_DETACHED_TIME = 2.0
# A mask is unchanged when this share of its pixels is; a resting hand varies more in seconds.
_UNCHANGED_SHARE = 0.93
# Margin (m) by which the new background lies in front of what was absorbed.
_MARGIN = 0.012
# It has left when readings this much (m) behind it are back in this share of its pixels.
_BEHIND = 0.03
_LEFT_SHARE = 0.25


class StaticForegroundDetector:
    """Detects a mask of hand and arm that has not changed for a given time (s)."""

    def __init__(self, still_time: float) -> None:
        self._still_time = nanoseconds(still_time)
        self._reference: Index = np.zeros(0, np.intp)
        self._mask = np.zeros(0, bool)
        self._since = 0

    def update(self, stamp: int, pixels: Index, size: int, detached: bool = False) -> bool:
        """Process one frame's mask (flat indices); whether it has been unchanged that long.

        size: number of pixels of the whole image. detached: nothing of it reaches in over the
        table's edge, as a box that was put down: then a shorter time is enough.
        """
        if len(pixels) == 0 or not self._unchanged(pixels):
            self._reference, self._since = pixels, stamp
            self._mask = np.zeros(size, bool)
            self._mask[pixels] = True
            return False
        still_time = self._still_time
        if detached:
            still_time = min(still_time, nanoseconds(_DETACHED_TIME))
        if stamp - self._since < still_time:
            return False
        self._reference = np.zeros(0, np.intp)
        return True

    def _unchanged(self, pixels: Index) -> bool:
        if len(self._reference) == 0:
            return False
        # One pixel in seven is enough to estimate the overlap.
        both = 7 * int(np.count_nonzero(self._mask[pixels[::7]]))
        return both > _UNCHANGED_SHARE * max(len(pixels), len(self._reference))


@dataclass(frozen=True, eq=False)
class AbsorbedRegion:
    """A region made part of the background, with what is needed to undo that.

    pixels: flat indices (N,). depth: reading there when it was absorbed, m. nearest, table: values
    of the background there before.
    """

    pixels: Index
    depth: ImageF
    nearest: ImageF
    table: NDArray[np.bool_]

    def has_left(self, frame: RgbdFrame) -> bool:
        """Whether the surface behind is seen again in a sufficient share of the pixels."""
        now = frame.depth.ravel()[self.pixels]
        both = np.isfinite(now) & np.isfinite(self.depth)
        behind = now[both] > self.depth[both] + _BEHIND
        return len(behind) > 0 and float(behind.mean()) > _LEFT_SHARE

    def removed_from(self, background: Background) -> Background:
        """The background as it was before the region was absorbed."""
        nearest, table = background.nearest.copy(), background.table.copy()
        nearest.ravel()[self.pixels], table.ravel()[self.pixels] = self.nearest, self.table
        return replace(background, nearest=nearest, table=table)


def covered_region(background: Background) -> AbsorbedRegion:
    """What a hand hid of the table while the background was learned, as if it were absorbed."""
    pixels = np.flatnonzero(background.covered)
    table = np.ones(len(pixels), bool)
    return AbsorbedRegion(
        pixels, background.depth.ravel()[pixels], background.bare.ravel()[pixels], table
    )


def absorb(
    background: Background, frame: RgbdFrame, pixels: Index
) -> tuple[Background, AbsorbedRegion]:
    """The background with the surface at some pixels (flat indices) made part of it."""
    mask = cv2.dilate(mask_of(pixels, frame.depth.shape), np.ones((7, 7), np.uint8)) > 0
    grown = np.flatnonzero(mask)
    before = background.nearest.ravel()[grown], background.table.ravel()[grown]
    near = np.nan_to_num(frame.depth, nan=np.inf)
    near = cv2.erode(near.astype(np.float32), np.ones((5, 5), np.uint8)) - np.float32(_MARGIN)
    nearest = np.where(mask, np.minimum(background.nearest, near), background.nearest)
    with_it = replace(
        background, nearest=nearest.astype(np.float32), table=background.table & ~mask
    )
    return with_it, AbsorbedRegion(grown, frame.depth.ravel()[grown], *before)
