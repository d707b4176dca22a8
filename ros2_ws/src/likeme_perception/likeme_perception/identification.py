"""Identification of blobs by colour and size: probability of each object, and of none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from likeme_perception.catalogue import Catalogue, ClippedCatalogue
from likeme_perception.colour import UNKNOWN_LOG_DENSITY, Bins
from likeme_perception.top_view import Shape

# Neighbouring pixels are correlated: the pixels of a blob count as so many independent ones.
_INDEPENDENT_PIXELS = 6.0
# Standard deviation of the logarithm of each seen extent of an object in one of its poses.
_SIZE_DEVIATION = 0.13
# What is so many times as long as an object is none of its poses: it is something else, or more.
_TOO_LONG = 1.6
# Shortest and longest extent, m, of objects in no catalogue; their logarithms are uniform.
_SHORTEST, _LONGEST = 0.01, 0.4
# Probability that an object in no catalogue has the colours of a known one.
_SAME_COLOUR = 0.5
# Least probability of what a blob may be.
_POSSIBLE = 0.01
# So many objects are at most one blob each; 2 ** _ONCE sets of them are looked at.
_ONCE = 10


class Assignment(NamedTuple):
    """The blob assigned to an object, and the probability that it is that object."""

    blob: int
    probability: float


def identity_probability(
    catalogue: Catalogue, bins: Bins, shape: Shape | None = None, whole: bool = True
) -> NDArray[np.float64]:
    """p(object | pixels, size), with "none of them" as last element; sums to 1, (objects + 1,).

    log p = n mean_i log p(colour_i | object) + log p(size | object), n independent pixels. What is
    in no catalogue has any colour and any size, or any size and the colours of a known object.
    shape: None: size is not used; its height is not used if it is NaN. whole: False when part of
    the blob is hidden; then its size only tells what it is too long for.
    """
    if len(bins) == 0:
        raise ValueError('Expected pixels to identify, got 0.')
    if not catalogue.objects:
        return np.ones(1)
    colour = catalogue.log_density[:, bins].mean(axis=1, dtype=np.float64)
    score = _INDEPENDENT_PIXELS * np.append(colour, UNKNOWN_LOG_DENSITY)
    if shape is not None:
        if whole:
            score[-1] = np.logaddexp(score[-1], score[:-1].max() + np.log(_SAME_COLOUR))
            score[-1] += _any_size_log_density(shape)
            score[:-1] += _size_log_density(shape, catalogue)
        # A size that fits does not make up for colours that do not.
        none = (shape.length > _TOO_LONG * catalogue.lengths) | (colour < UNKNOWN_LOG_DENSITY)
        score[:-1][none] = -np.inf
    weight = np.exp(score - score.max())
    return np.asarray(weight / weight.sum())


def _size_log_density(shape: Shape, catalogue: Catalogue) -> NDArray[np.float64]:
    """log p(extents | object) of the logarithms of length, width and height, over its poses."""
    seen = np.array((shape.length, shape.width, shape.height))
    # The height may be NaN.
    used = 2 if np.isnan(shape.height) else 3
    off = np.log(np.maximum(seen[:used], 1e-3)) - catalogue.log_poses[:, :, :used]
    density = np.exp(-0.5 * ((off / _SIZE_DEVIATION) ** 2).sum(axis=2)).mean(axis=1)
    norm = used * np.log(_SIZE_DEVIATION * np.sqrt(2 * np.pi))
    return np.asarray(np.log(density + 1e-300) - norm)


def _any_size_log_density(shape: Shape) -> float:
    """The same of an object in no catalogue; its width is at most its length."""
    extents = 2 if np.isnan(shape.height) else 3
    return float(np.log(2.0) - extents * np.log(np.log(_LONGEST / _SHORTEST)))


def fits(probability: NDArray[np.float64], least: float) -> int | None:
    """The object that a blob may be called, by catalogue index; None: none of them.

    It is at least so probable, and more than none of them. probability: (objects + 1,).
    """
    if len(probability) < 2:
        return None
    k = int(probability[:-1].argmax())
    return k if probability[k] >= least and probability[k] > probability[-1] else None


def one_of_each(probability: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same where each object is at most one of the blobs, (blobs, objects + 1).

    The marginals over all assignments of objects to blobs, weighted by the product of their
    probabilities; dynamic programming over the set of objects that are taken. Of many objects the
    least likely ones may be several blobs, as what is in no catalogue.
    """
    blobs, objects = len(probability), probability.shape[1] - 1
    once = np.argsort(-probability[:, :-1].max(axis=0, initial=0.0), kind='stable')[:_ONCE]
    often = np.setdiff1d(np.arange(objects + 1), once)
    taken = np.arange(1 << len(once))
    free = [np.flatnonzero(taken >> bit & 1 == 0) for bit in range(len(once))]
    before = np.zeros((blobs + 1, len(taken)))
    after = np.zeros((blobs + 1, len(taken)))
    before[0, 0], after[blobs] = 1.0, 1.0
    for b in range(blobs):
        before[b + 1] = before[b] * probability[b, often].sum()
        for bit, k in enumerate(once):
            before[b + 1, free[bit] | 1 << bit] += before[b, free[bit]] * probability[b, k]
    for b in reversed(range(blobs)):
        after[b] = after[b + 1] * probability[b, often].sum()
        for bit, k in enumerate(once):
            after[b, free[bit]] += after[b + 1, free[bit] | 1 << bit] * probability[b, k]
    joint = np.zeros_like(probability)
    for b in range(blobs):
        joint[b, often] = probability[b, often] * (before[b] @ after[b + 1])
        for bit, k in enumerate(once):
            pairs = before[b, free[bit]] @ after[b + 1, free[bit] | 1 << bit]
            joint[b, k] = probability[b, k] * pairs
    return np.asarray(joint / joint.sum(axis=1, keepdims=True))


def alike_in_colour(catalogue: Catalogue, bins: Bins) -> set[int]:
    """The object, if any, that a blob most probably is by its colours alone.

    Where colours are clipped, all that it may be.
    """
    if not catalogue.objects:
        return set()
    probability = identity_probability(catalogue, bins)
    if isinstance(catalogue, ClippedCatalogue):
        return possible(probability)
    return {int(probability.argmax())} - {len(catalogue.objects)}


def possible(probability: NDArray[np.float64]) -> set[int]:
    """The objects that a blob may be, however unlikely; probability: (objects + 1,)."""
    return {int(k) for k in np.flatnonzero(probability[:-1] > _POSSIBLE)}


def alike_in_size(catalogue: Catalogue, shape: Shape) -> set[int]:
    """The objects that are not much longer or shorter than a shape."""
    ratios = (shape.length / known.length for known in catalogue.objects)
    return {k for k, ratio in enumerate(ratios) if 1 / _TOO_LONG < ratio < _TOO_LONG}


def assign(probability: NDArray[np.float64], least: float) -> dict[int, Assignment]:
    """The optimal one-to-one assignment (Hungarian method), by object index.

    probability: (blobs, objects + 1) from identity_probability. Pairs that do not fit are left
    out.
    """
    if probability.size == 0 or probability.shape[1] < 2:
        return {}
    named = probability[:, :-1]
    allowed = (named >= least) & (named > probability[:, -1:])
    cost = np.where(allowed, -np.log(np.maximum(named, 1e-12)), 1e3)
    rows, columns = linear_sum_assignment(cost)
    return {
        int(k): Assignment(int(b), float(named[b, k]))
        for b, k in zip(rows, columns, strict=True)
        if allowed[b, k]
    }
