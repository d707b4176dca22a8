"""What a hand or an arm looks like, learned on line: a glove or a sleeve needs no setting."""

from __future__ import annotations

from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.colour import BINS, UNKNOWN_LOG_DENSITY, Bins, LogDensity, OnlineColour
from likeme_perception.segmentation import Index, rows_and_columns

ImageF = NDArray[np.float32]
Mask = NDArray[np.bool_]

# A pixel of an intruder is a thing's when the catalogue explains its colour better by this log
# ratio.
_CUT = 1.0
# A loose piece is the intruder's when its colours explain the piece better by this log ratio.
_JOIN = 0.5


class IntruderColour:
    """The colours of a hand or of an arm, beside those of the known things."""

    def __init__(self, known: LogDensity | None) -> None:
        """known: greatest log p(colour) of any known thing at each bin, None without any."""
        self._known = known
        others = np.full(BINS, UNKNOWN_LOG_DENSITY) if known is None else known
        self._others = np.maximum(others, UNKNOWN_LOG_DENSITY)
        self._seen = OnlineColour()

    @property
    def log_density(self) -> LogDensity:
        """log p(colour) at each bin."""
        return self._seen.log_density

    def learn(self, bins: Bins) -> None:
        """Learn from an intruder's pixels, but for those a known thing may explain."""
        if self._known is not None:
            bins = bins[self._known.take(bins) < UNKNOWN_LOG_DENSITY + 2.0]
        self._seen.show(bins)

    def things_among(self, pixels: Index, bins: Bins, width: int) -> Mask:
        """Which of an intruder's pixels look, with those about them, like known things.

        pixels: flat indices (N,) in an image of that width.
        """
        if self._known is None:
            return np.zeros(len(pixels), bool)
        density = np.maximum(self.log_density, UNKNOWN_LOG_DENSITY)
        ratio = np.asarray(self._known - density, np.float32)
        return np.asarray(_smooth(ratio.take(bins), pixels, width) > _CUT)

    def explains(self, bins: Bins) -> bool:
        """Whether a loose piece looks like the intruder rather than like anything else."""
        if not self._seen.known:
            return False
        return float(np.mean(self.log_density.take(bins) - self._others.take(bins))) > _JOIN


def _smooth(values: ImageF, pixels: Index, width: int) -> ImageF:
    """Mean over the pixels' own neighbours within a 7x7 window."""
    rows, columns = rows_and_columns(pixels, width)
    rows, columns = rows - rows.min(), columns - columns.min()
    box = int(rows.max()) + 1, int(columns.max()) + 1
    at = rows * box[1] + columns
    image, weight = np.zeros(box, np.float32), np.zeros(box, np.uint8)
    image.ravel()[at], weight.ravel()[at] = values, 1
    total, count = (cv2.boxFilter(i, -1, (7, 7), normalize=False) for i in (image, weight))
    return cast(ImageF, total.take(at) / count.take(at))
