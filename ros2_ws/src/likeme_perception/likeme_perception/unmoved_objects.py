"""Identity by place: what has not moved is what it was, whatever its colours are now."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from likeme_perception.blobs import Index
from likeme_perception.object_detection import Detections, ObjectDetection
from likeme_perception.rise_estimation import horizontal_distance
from likeme_perception.top_view import Shape

# Of an object that has not moved, this share of the pixels is in one blob, which is at most so
# many times as large.
_OVERLAP, _LARGER = 0.7, 1.3
# What is seen within this distance, m, of where an object lay is where it lay.
_SAME_PLACE = 0.015


class Unmoved(NamedTuple):
    """An object whose surface has not changed since it was identified.

    pixels: flat indices where it has not; area: its usual one, m^2; identity: its probability.
    """

    pixels: Index
    shape: Shape
    area: float
    identity: float


def keep_identities(
    found: Detections, unmoved: Mapping[int, Unmoved]
) -> tuple[Detections, set[int]]:
    """The detections where each unmoved object is what lies in its place, and contested objects.

    Colours change with a shadow or a lamp; a surface that nothing has hidden or moved is still
    that of the same object. unmoved: by catalogue index. An object is contested if it was
    identified elsewhere although its place has not changed, and nothing there can be it.
    """
    named, rest = dict(found.named), list(found.rest)
    contested: set[int] = set()
    for k, place in unmoved.items():
        own = named.get(k)
        if own is not None and _is_at(own, place):
            continue
        there = _at(place, rest)
        taken_for = None if there else _named_at(place, named, unmoved)
        if taken_for is not None:
            there = named.pop(taken_for)
        if own is not None:
            rest.append(named.pop(k))
            contested |= {k} if there is None else set()
        if there is not None:
            rest = [s for s in rest if s is not there]
            named[k] = there._replace(identity=place.identity)
    return found._replace(named=named, rest=rest), contested


def lies_at(s: ObjectDetection, place: tuple[float, float, float], within: float) -> bool:
    """Whether a detection is within a distance, m, of a place in the top view."""
    return horizontal_distance(s.shape.centroid, place) < within


def _is_at(s: ObjectDetection, place: Unmoved) -> bool:
    return lies_at(s, place.shape.centroid, _SAME_PLACE)


def _covers(s: ObjectDetection, place: Unmoved) -> bool:
    if s.blob.area > _LARGER * place.area:
        return False
    covered = np.isin(place.pixels, s.blob.pixels, assume_unique=True)
    return bool(covered.mean() > _OVERLAP)


def _at(place: Unmoved, detections: list[ObjectDetection]) -> ObjectDetection | None:
    return next((s for s in detections if _is_at(s, place) and _covers(s, place)), None)


def _named_at(
    place: Unmoved, named: Mapping[int, ObjectDetection], unmoved: Mapping[int, Unmoved]
) -> int | None:
    """The object that what lies there was taken for, by catalogue index; None: for none."""
    for k, s in named.items():
        at_its_own = k in unmoved and _is_at(s, unmoved[k])
        if not at_its_own and _is_at(s, place) and _covers(s, place):
            return k
    return None
