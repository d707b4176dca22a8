"""Pieces of one thing put together, and things that touch taken apart, by colour and size."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.identification import Catalogue, identity_probability
from likeme_perception.segmentation import Blob, Index, merged, rows_and_columns

# A blob with this much more surface than the thing it looks like may be two things.
_TOO_LARGE = 1.25
# Least share of its usual area that a thing must have to be cut out of a blob.
_SHARE = 0.35


def parts_by_colour(blob: Blob, width: int, catalogue: Catalogue) -> list[Blob]:
    """Take a blob apart that is too large for one thing and has two things' colours.

    width: of the image.
    """
    if len(catalogue.objects) < 2:
        return [blob]
    likeliest = catalogue.likeliest[blob.bins]
    known = catalogue.objects[int(np.bincount(likeliest).argmax())]
    if blob.area < _TOO_LARGE * known.area:
        return [blob]
    named = _majority(likeliest, blob.pixels, width, len(catalogue.objects))
    parts = [blob.part(named == k) for k in range(len(catalogue.objects))]
    large = [k for k, p in enumerate(parts) if p.area > _SHARE * catalogue.objects[k].area]
    if len(large) < 2:
        return [blob]
    return [parts[k] for k in large]


def _majority(label: NDArray[np.intp], pixels: Index, width: int, count: int) -> NDArray[np.intp]:
    """The most frequent label within an 11x11 window about each pixel."""
    rows, columns = rows_and_columns(pixels, width)
    rows, columns = rows - rows.min(), columns - columns.min()
    votes = np.zeros((count, int(rows.max()) + 1, int(columns.max()) + 1), np.float32)
    votes[label, rows, columns] = 1
    smooth = np.stack([cv2.boxFilter(v, -1, (11, 11), normalize=False) for v in votes])
    return np.asarray(smooth[:, rows, columns].argmax(axis=0))


def pieces_joined(blobs: list[Blob], catalogue: Catalogue) -> list[Blob]:
    """Join blobs that look like one thing and lie within its length: an arm is in front."""
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
            if both.extent <= 1.35 * catalogue.objects[k].length:
                whole[k] = both
            else:
                rest.append(blob)
    return [*whole.values(), *rest]
