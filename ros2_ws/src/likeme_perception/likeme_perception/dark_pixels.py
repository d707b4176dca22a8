"""Pixels of the still scene that are darker than the table: they tell a light it saturates in."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_core.table import DarkPlace
from likeme_perception.background import Background
from likeme_perception.camera_view import CameraView
from likeme_perception.light import Caps, Light, clipped_light

ImageB = NDArray[np.uint8]
ImageF = NDArray[np.float32]
Index = NDArray[np.intp]

# Least and greatest taught value of a dark pixel: below, a step of 8 bits is too much of it.
_LEAST, _GREATEST = 20, 140
# Pixels to each side of a place's own.
_BESIDE = 1
# A pixel whose depth is off by more than this, m, is covered by something.
_UNCOVERED = 0.02
# A value below this is not saturated; values that are expected below the other are not either.
_CLEAR, _SURELY_CLEAR = 250, 235
# Least pixels to tell a channel by; greatest deviation from their median of four in five of them.
_FEWEST, _SPREAD, _SHARE = 12, 0.1, 0.8
# At most so many pixels of the background are looked at.
_MOST = 600


class DarkPixels(NamedTuple):
    """Flat indices (N,), depths (N,) m, and taught colours (N, 3); 0: that channel is not dark."""

    pixels: Index
    depth: ImageF
    taught: ImageF

    def with_others(self, other: DarkPixels) -> DarkPixels:
        """These and others."""
        return DarkPixels(
            np.concatenate([self.pixels, other.pixels]),
            np.concatenate([self.depth, other.depth]),
            np.concatenate([self.taught, other.taught]),
        )

    def light(self, rgb: ImageB, depth: ImageF) -> Light | None:
        """The light on an image (H, W, 3) with its depth (H, W); None: it is not told.

        The pixels that nothing covers have to agree on the factor of each channel.
        """
        uncovered = np.abs(depth.take(self.pixels) - self.depth) < _UNCOVERED
        seen = rgb.reshape(-1, 3).take(self.pixels[uncovered], axis=0).astype(np.float32)
        taught = self.taught[uncovered]
        factor = [_factor(seen[:, c], taught[:, c]) for c in range(3)]
        if None in factor:
            return None
        red, green, blue = (float(f) for f in factor if f is not None)
        return clipped_light((red, green, blue))


def _factor(seen: ImageF, taught: ImageF) -> float | None:
    """The factor of one channel by some pixels, (N,) each; None: too few, or they disagree."""
    clear = (seen < _CLEAR) & (taught >= _LEAST)
    if np.count_nonzero(clear) < _FEWEST:
        return None
    first = float(np.median(seen[clear] / taught[clear]))
    # What saturates in part would be missing above the median.
    used = (taught >= _LEAST) & (taught * first < _SURELY_CLEAR)
    if np.count_nonzero(used) < _FEWEST:
        return None
    ratio = seen[used] / taught[used]
    factor = float(np.median(ratio))
    near = np.abs(ratio - factor) < _SPREAD * factor
    return factor if factor > 0 and float(near.mean()) >= _SHARE else None


def at_places(places: Sequence[DarkPlace], view: CameraView) -> DarkPixels:
    """The pixels at some places and beside them, where they are in view."""
    none = DarkPixels(np.zeros(0, np.intp), np.zeros(0, np.float32), np.zeros((0, 3), np.float32))
    return reduce(DarkPixels.with_others, (_at_place(place, view) for place in places), none)


def _at_place(place: DarkPlace, view: CameraView) -> DarkPixels:
    height, width = view.intrinsics.shape
    column, row = (round(float(v)) for v in view.project(np.array([place.at]))[0])
    away = float((np.asarray(place.at) - view.pose[:3, 3]) @ view.pose[:3, 2])
    near = np.arange(-_BESIDE, _BESIDE + 1)
    rows, columns = (v.ravel() for v in np.meshgrid(row + near, column + near, indexing='ij'))
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width) & (away > 0)
    pixels = (rows * width + columns)[inside].astype(np.intp)
    return DarkPixels(
        pixels,
        np.full(len(pixels), away, np.float32),
        np.tile(np.asarray(place.colour, np.float32), (len(pixels), 1)),
    )


def of_background(background: Background, caps: Caps = (255, 255, 255)) -> DarkPixels:
    """The dark pixels of a background in the taught colours, which are cut off at `caps`."""
    greatest = np.minimum(_GREATEST, np.asarray(caps) * (_SURELY_CLEAR / 255))
    dark = (background.colour >= _LEAST) & (background.colour <= greatest)
    pixels = np.flatnonzero(dark.any(axis=2) & np.isfinite(background.depth))
    pixels = pixels[:: max(1, len(pixels) // _MOST)]
    colours = np.where(dark, background.colour, 0).reshape(-1, 3).take(pixels, axis=0)
    depth = background.depth.take(pixels).astype(np.float32)
    return DarkPixels(pixels, depth, colours.astype(np.float32))
