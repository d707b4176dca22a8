"""Whether an image has shifted or turned, by the edges of what does not move."""

from __future__ import annotations

from functools import cached_property
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

ImageB = NDArray[np.uint8]
ImageF = NDArray[np.float32]
Index = NDArray[np.intp]

# Shifts are looked for up to so many pixels along each axis of an image 640 wide; those up to the
# second are none: edges of a Kinect's depth vary by as much.
_WIDTH, _REACH, _NONE = 640, 24, 2
# So many of the strongest edges are compared; with fewer than the second nothing is told.
_EDGES, _LEAST = 800, 100
# Turns about the middle of the image that are looked for, degrees, each with these shifts, pixels.
_TURNS, _TURN_SHIFTS = (-4.0, -2.0, -1.0, 1.0, 2.0, 4.0), (-4, 0, 4)
# An image has moved if its edges fit so many times as well elsewhere; edges that fit themselves
# less than so many times as well as they fit any shift tell nothing.
_BETTER, _DISTINCT = 1.15, 1.5
# A step of the depth, m, is an edge.
_STEP = 0.05
_AROUND = np.ones((3, 3), np.uint8)


def colour_edges(rgb: ImageB) -> ImageB:
    """Gradient of the brightness of an image (H, W, 3), greatest around each pixel, (H, W)."""
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    across = cv2.convertScaleAbs(cv2.Sobel(grey, cv2.CV_16S, 1, 0))
    down = cv2.convertScaleAbs(cv2.Sobel(grey, cv2.CV_16S, 0, 1))
    return cast(ImageB, cv2.dilate(cv2.addWeighted(across, 0.5, down, 0.5, 0), _AROUND))


def depth_edges(depth: ImageF) -> ImageB:
    """Where the depth (H, W), m, NaN = none, has a step, 0 or 255, (H, W)."""
    none = np.isnan(depth)
    farthest = cv2.dilate(np.where(none, np.float32(0), depth), _AROUND)
    nearest = cv2.erode(np.where(none, np.float32(np.inf), depth), _AROUND)
    step = (farthest - nearest > _STEP).view(np.uint8) * np.uint8(255)
    return cast(ImageB, cv2.dilate(step, _AROUND))


class EdgeAlignment:
    """Compares the edges of images with those of the still scene in a first one."""

    def __init__(self, edges: ImageB, still: NDArray[np.bool_]) -> None:
        """edges: of the first image, (H, W). still: pixels of what will not move, (H, W)."""
        self._shape = edges.shape
        scale = edges.shape[1] / _WIDTH
        step = max(1, round(2 * scale))
        reach = step * max(2, round(_REACH * scale / step))
        self._steps = np.arange(-reach, reach + 1, step)
        self._none = max(1, round(_NONE * scale))
        inner = np.zeros(edges.shape, bool)
        inner[reach:-reach, reach:-reach] = True
        strength = np.where(inner & still, edges, 0).ravel()
        strongest = np.argsort(strength, kind='stable')[::-1][: 8 * _EDGES : 8]
        self._pixels: Index = strongest[strength[strongest] > 0]
        self._turned = self._turns(scale)
        self._first = edges

    @cached_property
    def distinct(self) -> bool:
        """Whether there are edges enough, and no pattern that fits itself when it is shifted."""
        if len(self._pixels) < _LEAST:
            return False
        fit = self._fit(self._first)
        return bool(fit.max() >= _DISTINCT * np.median(fit))

    def moved(self, edges: ImageB) -> bool:
        """Whether an image's edges have shifted, or turned about its middle; not if untold.

        edges: of that image, (H, W).
        """
        if not self.distinct:
            return False
        fit = self._fit(edges)
        near = np.abs(self._steps) <= self._none
        stays = fit[np.ix_(near, near)].max()
        turned = edges.ravel()[self._turned].mean(axis=-1)
        return bool(
            max(fit.max(), turned.max()) > max(_BETTER * stays, _DISTINCT * np.median(fit))
        )

    def _turns(self, scale: float) -> Index:
        """Where the compared pixels are after each turn and shift, (M, N), within the image."""
        height, width = self._shape
        row, column = np.divmod(self._pixels, width)
        down, across = row - (height - 1) / 2, column - (width - 1) / 2
        turns = np.radians(_TURNS)[:, None, None, None]
        shifts = np.round(scale * np.array(_TURN_SHIFTS)).astype(np.intp)
        to_row = np.rint(row + turns * across).astype(np.intp) + shifts[:, None, None]
        to_column = np.rint(column - turns * down).astype(np.intp) + shifts[:, None]
        to = np.clip(to_row, 0, height - 1) * width + np.clip(to_column, 0, width - 1)
        return cast(Index, to.reshape(len(_TURNS) * len(_TURN_SHIFTS) ** 2, -1))

    def _fit(self, edges: ImageB) -> NDArray[np.float64]:
        """Mean strength of an image's edges where those of the first one are, by their shift."""
        offsets = (self._steps[:, None] * self._shape[1] + self._steps).ravel()
        found = edges.ravel()[self._pixels + offsets[:, None]]
        return cast(NDArray[np.float64], found.mean(axis=1)).reshape((len(self._steps),) * 2)
