"""Parts of a hand that depth misses: fingers flat on the table, edges without a reading."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.background import Background
from likeme_perception.colour import UNKNOWN_LOG_DENSITY, LogDensity, colour_bins, lab_at
from likeme_perception.rgbd import RgbdFrame
from likeme_perception.segmentation import Index, mask_of, rows_and_columns

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
    now, then = (lab_at(image, pixels) for image in (frame.rgb, background.colour))
    return np.asarray(_difference(now, then) > _DIFFERENT)


def grown_by_colour(
    frame: RgbdFrame, background: Background, hand: Index, colour: LogDensity, taken: ImageB
) -> Index:
    """Pixels beside a hand's that have its colours and not the background's, flat indices.

    taken: pixels (H, W) that are known to be something else.
    """
    if len(hand) == 0:
        return hand
    width = frame.depth.shape[1]
    rows, columns = rows_and_columns(hand, width)
    r0, r1 = max(int(rows.min()) - _REACH, 0), int(rows.max()) + _REACH + 1
    c0, c1 = max(int(columns.min()) - _REACH, 0), int(columns.max()) + _REACH + 1
    box = np.s_[r0:r1, c0:c1]
    mine = mask_of(hand, frame.depth.shape)[box]
    ring = cv2.dilate(mine, np.ones((2 * _REACH + 1,) * 2, np.uint8)) > mine
    ring &= taken[box] == 0
    r, c = rows_and_columns(np.flatnonzero(ring), ring.shape[1])
    if len(r) == 0:
        return r
    pixels = (r + r0) * width + c + c0
    like = colour[colour_bins(frame.rgb, pixels)] > UNKNOWN_LOG_DENSITY + _CLEARLY
    alike = pixels[like]
    return np.asarray(alike[unlike_background(frame, background, alike)], np.intp)


def _difference(a: ImageB, b: ImageB) -> NDArray[np.float32]:
    """CIELAB distance of 8-bit colours (N, 3); L counts little: shadows are no difference."""
    delta = np.ascontiguousarray(a.T).astype(np.float32) - b.T
    delta[0] *= np.float32(0.2)
    delta *= delta
    return np.asarray(np.sqrt(delta[0] + delta[1] + delta[2]))
