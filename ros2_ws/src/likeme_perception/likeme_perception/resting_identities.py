"""Identities of what rests, kept from when more was seen beside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_core.stamps import nanoseconds
from likeme_perception.identification import one_of_each

Probability = NDArray[np.float64]

# What is within this distance, m, of a place, with an area off by at most this ratio, is what was
# there; unless it was not seen for so long, s.
_SAME_PLACE, _SAME_AREA, _GAP = 0.008, 1.25, 0.5
# Least share of a frame in the mean: the first ones may show a hand that leaves.
_LEAST_SHARE = 0.25
# Probability that what is beside a hand or an arm is anything.
_DOUBT, _TINY = 0.05, 1e-12


class Resting(NamedTuple):
    """One blob: (x, y), m; area, m^2; whether a hand or an arm is beside it."""

    place: tuple[float, float]
    area: float
    touched: bool


class _Told(NamedTuple):
    """Mean probability over the frames in which most was seen: so many objects, so many frames."""

    blob: Resting
    probability: Probability
    objects: int
    frames: int
    stamp: int


class RestingIdentities:
    """Remembers what blobs were told to be while nothing touches or moves them.

    Where objects look alike, each is told by the others that are there. When one of them is taken
    away, what is left alone is no less sure than before; and what a hand has taken is not what
    still rests. Of that a part is seen: its colours tell less.
    """

    def __init__(self) -> None:
        self._told: list[_Told] = []

    def remembered(
        self, stamp: int, blobs: Sequence[Resting], probability: Probability
    ) -> Probability:
        """Probabilities from those of each blob by itself, (blobs, objects + 1).

        Of what rests those of this frame, or of the frames before it.
        """
        touched = np.array([blob.touched for blob in blobs], bool)
        result = probability.copy()
        result[~touched] = one_of_each(probability[~touched])
        objects = int(np.count_nonzero(probability[:, -1] < 0.5))
        told = []
        for b in np.flatnonzero(~touched).tolist():
            now = _Told(blobs[b], result[b], objects, 1, stamp)
            before = self._before(now)
            if before is not None and (before.objects > objects or touched.any()):
                now = before._replace(stamp=stamp)
            elif before is not None and before.objects == objects:
                share = max(1 / (before.frames + 1), _LEAST_SHARE)
                mean = (1 - share) * before.probability + share * result[b]
                now = now._replace(probability=mean, frames=before.frames + 1)
            told.append(now)
            result[b] = now.probability
        self._told = told
        if touched.any():
            elsewhere = np.append(np.prod(1 - result[~touched, :-1], axis=0), 1.0)
            rest = one_of_each(probability[touched] * elsewhere + _TINY)
            result[touched] = (1 - _DOUBT) * rest + _DOUBT / result.shape[1]
        return result

    def _before(self, now: _Told) -> _Told | None:
        """What was told of the same blob in the frame before; None: nothing."""
        for each in self._told:
            away = float(np.hypot(*np.subtract(each.blob.place, now.blob.place)))
            ratio = each.blob.area / now.blob.area
            same = away < _SAME_PLACE and 1 / _SAME_AREA < ratio < _SAME_AREA
            if same and abs(now.stamp - each.stamp) <= nanoseconds(_GAP):
                return each
        return None
