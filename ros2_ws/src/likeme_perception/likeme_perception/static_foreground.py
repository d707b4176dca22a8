"""Motion decides what stays a hand: what reaches in and never moves was put there.

Until it moves after all: then it is a hand again, and the background is as it was before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.background import Background
from likeme_perception.rgbd import RgbdFrame
from likeme_perception.segmentation import Index, mask_of

ImageF = NDArray[np.float32]

SECOND = 1_000_000_000
# A hand at rest still changes more than this share of its pixels within some seconds.
_SAME = 0.93
# Margin (m) by which the new background lies in front of what was put there.
_MARGIN = 0.012
# It has left when readings this much (m) behind it are back in this share of its pixels.
_BEHIND = 0.03
_LEFT = 0.25


class StillnessWatch:
    """Notices an intruder whose pixels have stayed the same for a given time (s)."""

    def __init__(self, still_time: float) -> None:
        self._still_time = int(still_time * SECOND)
        self._reference: Index = np.zeros(0, np.intp)
        self._mask = np.zeros(0, bool)
        self._since = 0

    def still(self, stamp: int, pixels: Index, size: int) -> bool:
        """Take one frame's pixels (flat indices); whether they have not moved for that long.

        size: number of pixels of the whole image.
        """
        if len(pixels) == 0 or not self._alike(pixels):
            self._reference, self._since = pixels, stamp
            self._mask = np.zeros(size, bool)
            self._mask[pixels] = True
            return False
        if stamp - self._since < self._still_time:
            return False
        self._reference = np.zeros(0, np.intp)
        return True

    def _alike(self, pixels: Index) -> bool:
        if len(self._reference) == 0:
            return False
        both = 7 * int(np.count_nonzero(self._mask[pixels[::7]]))
        return both > _SAME * max(len(pixels), len(self._reference))


@dataclass(frozen=True, eq=False)
class StillThing:
    """What was made background, to be taken out of it again when it leaves.

    pixels: flat indices (N,). depth: what was read there, m. nearest, table: the background's
    there before.
    """

    pixels: Index
    depth: ImageF
    nearest: ImageF
    table: NDArray[np.bool_]

    def has_left(self, frame: RgbdFrame) -> bool:
        """Whether what lies behind it is seen again in a good part of its pixels."""
        now = frame.depth.ravel()[self.pixels]
        both = np.isfinite(now) & np.isfinite(self.depth)
        behind = now[both] > self.depth[both] + _BEHIND
        return len(behind) > 0 and float(behind.mean()) > _LEFT

    def removed_from(self, background: Background) -> Background:
        """The background as it was before."""
        nearest, table = background.nearest.copy(), background.table.copy()
        nearest.ravel()[self.pixels], table.ravel()[self.pixels] = self.nearest, self.table
        return replace(background, nearest=nearest, table=table)


def absorbed(
    background: Background, frame: RgbdFrame, pixels: Index
) -> tuple[Background, StillThing]:
    """The background with what stands at some pixels (flat indices) made part of it."""
    mask = cv2.dilate(mask_of(pixels, frame.depth.shape), np.ones((7, 7), np.uint8)) > 0
    grown = np.flatnonzero(mask)
    before = background.nearest.ravel()[grown], background.table.ravel()[grown]
    near = np.nan_to_num(frame.depth, nan=np.inf)
    near = cv2.erode(near.astype(np.float32), np.ones((5, 5), np.uint8)) - np.float32(_MARGIN)
    nearest = np.where(mask, np.minimum(background.nearest, near), background.nearest)
    with_it = replace(
        background, nearest=nearest.astype(np.float32), table=background.table & ~mask
    )
    return with_it, StillThing(grown, frame.depth.ravel()[grown], *before)
