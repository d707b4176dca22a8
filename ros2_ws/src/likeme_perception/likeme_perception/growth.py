"""Parts of a hand that depth misses: fingers flat on the table, edges without a reading."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.background import Background
from likeme_perception.colour import UNKNOWN_LOG_DENSITY, LogDensity, bins_of_lab
from likeme_perception.rgbd import RgbdFrame
from likeme_perception.segmentation import Index, mask_of

ImageB = NDArray[np.uint8]

# How far (pixels) colour may carry on what depth began.
_REACH = 12
# Least difference from the background's colour there, CIELAB units.
_DIFFERENT = 22.0
# The hand's colours must explain a pixel better than "something unknown" by this log ratio.
_CLEARLY = 1.5


def unlike_background(
    frame: RgbdFrame, background: Background, pixels: Index
) -> NDArray[np.bool_]:
    """Which pixels (flat indices) have another colour than the empty scene has there."""
    if len(pixels) == 0:
        return np.zeros(0, bool)
    now, then = (
        _lab(image.reshape(-1, 3)[pixels][None])[0] for image in (frame.rgb, background.colour)
    )
    return np.asarray(_difference(now, then) > _DIFFERENT)


def grown_by_colour(
    frame: RgbdFrame, background: Background, hand: Index, colour: LogDensity, taken: ImageB
) -> Index:
    """Pixels beside a hand's that have its colours and not the background's, flat indices.

    taken: pixels (H, W) that are known to be something else.
    """
    if len(hand) == 0:
        return hand
    rows, columns = np.divmod(hand, frame.depth.shape[1])
    r0, r1 = max(int(rows.min()) - _REACH, 0), int(rows.max()) + _REACH + 1
    c0, c1 = max(int(columns.min()) - _REACH, 0), int(columns.max()) + _REACH + 1
    box = np.s_[r0:r1, c0:c1]
    mine = mask_of(hand, frame.depth.shape)[box]
    ring = cv2.dilate(mine, np.ones((2 * _REACH + 1,) * 2, np.uint8)) > mine
    ring &= taken[box] == 0
    r, c = np.nonzero(ring)
    if len(r) == 0:
        return np.zeros(0, np.intp)
    now, then = (_lab(image[box][r, c][None])[0] for image in (frame.rgb, background.colour))
    like = colour[bins_of_lab(now)] > UNKNOWN_LOG_DENSITY + _CLEARLY
    like &= _difference(now, then) > _DIFFERENT
    return np.asarray((r[like] + r0) * frame.depth.shape[1] + c[like] + c0, np.intp)


def _lab(rgb: ImageB) -> ImageB:
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(rgb), cv2.COLOR_RGB2LAB), np.uint8)


def _difference(a: ImageB, b: ImageB) -> NDArray[np.float32]:
    """CIELAB distance of 8-bit colours (N, 3); L counts little: shadows are no difference."""
    delta = (a.astype(np.float32) - b) * np.array([0.2, 1.0, 1.0], np.float32)
    return np.asarray(np.sqrt((delta * delta).sum(axis=-1)))
