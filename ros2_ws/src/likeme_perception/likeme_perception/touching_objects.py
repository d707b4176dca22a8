"""Split and merge of blobs by colour and size: touching objects, and parts of one object."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.blobs import Blob, Index, merged, rows_and_columns
from likeme_perception.catalogue import Catalogue
from likeme_perception.identification import identity_probability

# A blob of this many times the area of its likeliest object may be two objects.
_TOO_LARGE = 1.25
# Least share of an object's usual area for it to be split off.
_LEAST_SHARE = 0.35
# Greatest extent of merged parts, in lengths of the object.
_GREATEST_EXTENT = 1.35


def split_by_colour(
    blob: Blob, width: int, catalogue: Catalogue, before: Sequence[Index] = ()
) -> list[Blob]:
    """Split a blob that has the colours of several objects.

    It must be too large for one, or have been several in the frame before: noise would else split
    and merge two that touch in turn.

    width: of the image. before: pixels of the objects of the frame before, flat indices.
    """
    if len(catalogue.objects) < 2:
        return [blob]
    likeliest = catalogue.likeliest[blob.bins]
    known = catalogue.objects[int(np.bincount(likeliest).argmax())]
    if blob.area < _TOO_LARGE * known.area and _covered(blob, before) < 2:
        return [blob]
    named = _majority(likeliest, blob.pixels, width, len(catalogue.objects))
    parts = [blob.part(named == k) for k in range(len(catalogue.objects))]
    large = [k for k, p in enumerate(parts) if p.area > _LEAST_SHARE * catalogue.objects[k].area]
    if len(large) < 2:
        return [blob]
    return [parts[k] for k in large]


def _covered(blob: Blob, before: Sequence[Index]) -> int:
    """How many objects of the frame before lie in a blob by half of their pixels or more."""
    low, high = int(blob.pixels.min()), int(blob.pixels.max())
    near = [pixels for pixels in before if pixels[-1] >= low and pixels[0] <= high]
    if len(near) < 2:
        return 0
    inside = np.zeros(high - low + 1, bool)
    inside[blob.pixels - low] = True
    shared = 0
    for pixels in near:
        within = pixels[(pixels >= low) & (pixels <= high)] - low
        shared += 2 * int(np.count_nonzero(inside[within])) >= len(pixels)
    return shared


def _majority(label: NDArray[np.intp], pixels: Index, width: int, count: int) -> NDArray[np.intp]:
    """The most frequent label in an 11x11 window around each pixel."""
    rows, columns = rows_and_columns(pixels, width)
    rows, columns = rows - rows.min(), columns - columns.min()
    votes = np.zeros((count, int(rows.max()) + 1, int(columns.max()) + 1), np.float32)
    votes[label, rows, columns] = 1
    smooth = np.stack([cv2.boxFilter(v, -1, (11, 11), normalize=False) for v in votes])
    return np.asarray(smooth[:, rows, columns].argmax(axis=0))


def merge_parts(blobs: list[Blob], catalogue: Catalogue) -> list[Blob]:
    """Merge blobs that are identified as one object and lie within its length.

    An arm in front of an object leaves several visible parts of it.
    """
    whole: dict[int, Blob] = {}
    rest: list[Blob] = []
    for blob in sorted(blobs, key=lambda b: -b.area):
        probability = identity_probability(catalogue, blob.bins)
        k = int(probability.argmax())
        if k == len(catalogue.objects):
            rest.append(blob)
        elif k not in whole:
            whole[k] = blob
        else:
            both = merged([whole[k], blob])
            if both.extent <= _GREATEST_EXTENT * catalogue.objects[k].length:
                whole[k] = both
            else:
                rest.append(blob)
    return [*whole.values(), *rest]
