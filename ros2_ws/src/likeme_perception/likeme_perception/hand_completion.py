"""Completion of a hand by colour where depth misses it: flat fingers, edges without reading."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.background import Background
from likeme_perception.blobs import Index, mask_of, rows_and_columns
from likeme_perception.colour import UNKNOWN_LOG_DENSITY, LogDensity, colour_bins, lab_at
from likeme_perception.rgbd import RgbdFrame

ImageB = NDArray[np.uint8]

# Distance (pixels) from the hand within which pixels are added.
_REACH = 12
# Least difference from the background's colour, CIELAB units.
_LEAST_DIFFERENCE = 22.0
# Least log likelihood ratio of the hand's colours against an unknown colour.
_LEAST_LOG_RATIO = 1.5


def differs_from_background(
    frame: RgbdFrame, background: Background, pixels: Index
) -> NDArray[np.bool_]:
    """Mask of the pixels (flat indices) whose colour differs from the background, (N,)."""
    if len(pixels) == 0:
        return np.zeros(0, bool)
    now, then = (lab_at(image, pixels) for image in (frame.rgb, background.colour))
    return np.asarray(_difference(now, then) > _LEAST_DIFFERENCE)


def complete_by_colour(
    frame: RgbdFrame, background: Background, hand: Index, colour: LogDensity, taken: ImageB
) -> Index:
    """Pixels next to the hand with its colours and not the background's, flat indices.

    taken: mask (H, W) of pixels that cannot be added.
    """
    if len(hand) == 0:
        return hand
    width = frame.depth.shape[1]
    rows, columns = rows_and_columns(hand, width)
    r0, r1 = max(int(rows.min()) - _REACH, 0), int(rows.max()) + _REACH + 1
    c0, c1 = max(int(columns.min()) - _REACH, 0), int(columns.max()) + _REACH + 1
    box = np.s_[r0:r1, c0:c1]
    mask = mask_of(hand, frame.depth.shape)[box]
    ring = cv2.dilate(mask, np.ones((2 * _REACH + 1,) * 2, np.uint8)) > mask
    ring &= taken[box] == 0
    r, c = rows_and_columns(np.flatnonzero(ring), ring.shape[1])
    if len(r) == 0:
        return r
    pixels = (r + r0) * width + c + c0
    like = colour[colour_bins(frame.rgb, pixels)] > UNKNOWN_LOG_DENSITY + _LEAST_LOG_RATIO
    alike = pixels[like]
    return np.asarray(alike[differs_from_background(frame, background, alike)], np.intp)


def _difference(a: ImageB, b: ImageB) -> NDArray[np.float32]:
    """CIELAB distance of 8-bit colours (N, 3), with a small weight of L: shadows change it."""
    delta = np.ascontiguousarray(a.T).astype(np.float32) - b.T
    delta[0] *= np.float32(0.2)
    delta *= delta
    return np.asarray(np.sqrt(delta[0] + delta[1] + delta[2]))
