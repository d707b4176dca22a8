"""Motion decides what stays a hand: what reaches in and never moves was put there."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from likeme_perception.background import Background
from likeme_perception.rgbd import RgbdFrame
from likeme_perception.segmentation import Index, mask_of

SECOND = 1_000_000_000
# A hand at rest still changes more than this share of its pixels within some seconds.
_SAME = 0.93
# Margin (m) by which the new background lies in front of what was put there.
_MARGIN = 0.012


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


def absorbed(background: Background, frame: RgbdFrame, pixels: Index) -> Background:
    """The background with what stands at some pixels (flat indices) made part of it."""
    mask = cv2.dilate(mask_of(pixels, frame.depth.shape), np.ones((7, 7), np.uint8)) > 0
    near = np.nan_to_num(frame.depth, nan=np.inf)
    near = cv2.erode(near.astype(np.float32), np.ones((5, 5), np.uint8)) - np.float32(_MARGIN)
    nearest = np.where(mask, np.minimum(background.nearest, near), background.nearest)
    return replace(background, nearest=nearest.astype(np.float32), table=background.table & ~mask)
