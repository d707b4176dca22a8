"""Colour model of a hand or arm, learned online, so that gloves and sleeves need no setting."""

from __future__ import annotations

from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.blobs import Index, rows_and_columns
from likeme_perception.colour import BINS, UNKNOWN_LOG_DENSITY, Bins, ColourHistogram, LogDensity

ImageF = NDArray[np.float32]
Mask = NDArray[np.bool_]

# Least log likelihood ratio of the catalogue for a pixel of a hand or arm to be an object's.
_OBJECT_LOG_RATIO = 1.0
# Least mean log likelihood ratio of the hand's or arm's colours for a separate blob to be part.
_PART_LOG_RATIO = 0.5


class HandArmColour:
    """Colour histogram of a hand or an arm, compared with the colours of known objects."""

    def __init__(self, known: LogDensity | None) -> None:
        """known: see compare_with."""
        self.compare_with(known)
        self._histogram = ColourHistogram()

    def compare_with(self, known: LogDensity | None) -> None:
        """Use other colours of the known objects from now on.

        known: greatest log p(colour) over them at each bin; None without any.
        """
        self._known = known
        others = np.full(BINS, UNKNOWN_LOG_DENSITY) if known is None else known
        self._others = np.maximum(others, UNKNOWN_LOG_DENSITY)

    @property
    def log_density(self) -> LogDensity:
        """log p(colour) at each bin."""
        return self._histogram.log_density

    def learn(self, bins: Bins) -> None:
        """Add the pixels of a hand or arm, except those that a known object may explain."""
        if self._known is not None:
            bins = bins[self._known.take(bins) < UNKNOWN_LOG_DENSITY + 2.0]
        self._histogram.update(bins)

    def object_pixels(self, pixels: Index, bins: Bins, width: int) -> Mask:
        """Mask of the pixels whose neighbourhood has the colours of known objects, (N,).

        pixels: flat indices (N,) of a hand or arm, in an image of that width.
        """
        if self._known is None:
            return np.zeros(len(pixels), bool)
        density = np.maximum(self.log_density, UNKNOWN_LOG_DENSITY)
        ratio = np.asarray(self._known - density, np.float32)
        return np.asarray(_smooth(ratio.take(bins), pixels, width) > _OBJECT_LOG_RATIO)

    def explains(self, bins: Bins) -> bool:
        """Whether a separate blob has the hand's or arm's colours rather than any other."""
        if not self._histogram.known:
            return False
        return (
            float(np.mean(self.log_density.take(bins) - self._others.take(bins))) > _PART_LOG_RATIO
        )


def _smooth(values: ImageF, pixels: Index, width: int) -> ImageF:
    """Mean over those of the pixels that lie within a 7x7 window."""
    rows, columns = rows_and_columns(pixels, width)
    rows, columns = rows - rows.min(), columns - columns.min()
    box = int(rows.max()) + 1, int(columns.max()) + 1
    at = rows * box[1] + columns
    image, weight = np.zeros(box, np.float32), np.zeros(box, np.uint8)
    image.ravel()[at], weight.ravel()[at] = values, 1
    total, count = (cv2.boxFilter(i, -1, (7, 7), normalize=False) for i in (image, weight))
    return cast(ImageF, total.take(at) / count.take(at))
