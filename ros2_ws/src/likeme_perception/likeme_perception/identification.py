"""Identification of blobs: probability of each catalogue object by colour and size."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from likeme_perception.catalogue import Catalogue
from likeme_perception.colour import UNKNOWN_LOG_DENSITY, Bins
from likeme_perception.top_view import Shape

# Neighbouring pixels are correlated: the pixels of a blob count as so many independent ones.
_INDEPENDENT_PIXELS = 6.0
# Relative standard deviation of an object's seen length and width over its poses.
_SIZE_DEVIATION = 0.3
# What is so many times as long as an object is none of its poses: it is something else, or more.
_TOO_LONG = 1.6


class Assignment(NamedTuple):
    """The blob assigned to an object, and the probability that it is that object."""

    blob: int
    probability: float


def identity_probability(
    catalogue: Catalogue, bins: Bins, shape: Shape | None = None, whole: bool = True
) -> NDArray[np.float64]:
    """p(object | pixels), with an unknown object as last element; sums to 1, (objects + 1,).

    log p = n mean_i log p(colour_i | object) + log p(size | object), n independent pixels.
    shape: None: size is not used. whole: False when part of the blob is hidden; then its size only
    tells what it is too long for.
    """
    if len(bins) == 0:
        raise ValueError('Expected pixels to identify, got 0.')
    colour = catalogue.log_density[:, bins].mean(axis=1, dtype=np.float64)
    score = _INDEPENDENT_PIXELS * np.append(colour, UNKNOWN_LOG_DENSITY)
    if shape is not None:
        for k, known in enumerate(catalogue.objects):
            sizes = ((shape.length, known.length), (shape.width, known.width))
            for seen, usual in sizes if whole else ():
                score[k] -= 0.5 * (np.log(max(seen, 1e-3) / usual) / _SIZE_DEVIATION) ** 2
            if shape.length > _TOO_LONG * known.length:
                score[k] = -np.inf
    weight = np.exp(score - score.max())
    return np.asarray(weight / weight.sum())


def alike_in_colour(catalogue: Catalogue, bins: Bins) -> set[int]:
    """The object, if any, that a blob most probably is by its colours alone."""
    if not catalogue.objects:
        return set()
    k = int(identity_probability(catalogue, bins).argmax())
    return {k} - {len(catalogue.objects)}


def alike_in_size(catalogue: Catalogue, shape: Shape) -> set[int]:
    """The objects that are not much longer or shorter than a shape."""
    ratios = (shape.length / known.length for known in catalogue.objects)
    return {k for k, ratio in enumerate(ratios) if 1 / _TOO_LONG < ratio < _TOO_LONG}


def assign(probability: NDArray[np.float64], least: float) -> dict[int, Assignment]:
    """The optimal one-to-one assignment (Hungarian method), by object index.

    probability: (blobs, objects + 1) from identity_probability. Pairs below `least` are left out.
    """
    if probability.size == 0 or probability.shape[1] < 2:
        return {}
    named = probability[:, :-1]
    cost = np.where(named >= least, -np.log(np.maximum(named, 1e-12)), 1e3)
    rows, columns = linear_sum_assignment(cost)
    return {
        int(k): Assignment(int(b), float(named[b, k]))
        for b, k in zip(rows, columns, strict=True)
        if named[b, k] >= least
    }
