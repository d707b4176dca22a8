"""Which of several objects that look the same is the known one, by where each was."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Sequence
from dataclasses import dataclass, field

import numpy as np

from likeme_core.stamps import nanoseconds
from likeme_perception.identification import fits, possible
from likeme_perception.object_detection import Detections, ObjectDetection

Place = tuple[float, float]

# What is within this distance, m, of a place is what was there.
_SAME_PLACE = 0.015


@dataclass
class _Kind:
    """Where the known object and others like it were last seen; lost: it cannot be told which."""

    place: Place | None = None
    others: list[Place] = field(default_factory=list)
    lost: bool = False
    unclear_since: int | None = None


class SameKindResolver:
    """Follows the known object among those that fit it, in frames without hand and arm.

    It is the one that stayed where it was, or the only one that moved while all others stayed. If
    neither is so for `settle_time`, it is lost among them, until tracking is reset.
    """

    def __init__(self, settle_time: float) -> None:
        self._settle = nanoseconds(settle_time)
        self._kinds: dict[int, _Kind] = {}

    def resolved(
        self, stamp: int, detections: Detections, limb: bool
    ) -> tuple[Detections, set[int]]:
        """The detections with the known ones named, and the objects that cannot be told.

        limb: whether a hand or an arm is in view, which may move one of them.
        """
        named, rest = dict(detections.named), list(detections.rest)
        unclear: set[int] = set()
        for k, candidates in self._candidates(detections).items():
            kind = self._kinds.setdefault(k, _Kind())
            chosen = self._chosen(kind, candidates, stamp, limb)
            if candidates and chosen is None and (kind.lost or kind.unclear_since is not None):
                unclear.add(k)
            if k in named and named[k] is not chosen:
                rest.append(named.pop(k))
            if chosen is not None and k not in named:
                named[k] = chosen._replace(identity=float(chosen.probability[k]))
                rest = [s for s in rest if s is not chosen]
        lost = {k for k, kind in self._kinds.items() if kind.lost}
        return detections._replace(named=named, rest=rest), unclear | lost

    def _candidates(self, detections: Detections) -> dict[int, list[ObjectDetection]]:
        """All that fits an object, by catalogue index: the named one, and what has no name."""
        found = {k: [s] for k, s in detections.named.items()}
        for k in self._kinds:
            found.setdefault(k, [])
        for s in detections.rest:
            fitted = fits(s.probability, detections.least)
            if fitted is not None and not s.beside_limb:
                found.setdefault(fitted, []).append(s)
        return found

    def _chosen(
        self, kind: _Kind, candidates: list[ObjectDetection], stamp: int, limb: bool
    ) -> ObjectDetection | None:
        if kind.lost or not candidates:
            return None
        own = _at(kind.place, candidates)
        if limb:
            alone = not kind.others and len(candidates) == 1
            return candidates[0] if alone else own
        there = [_at(place, candidates) for place in kind.others]
        free = [s for s in candidates if not any(s is other for other in there)]
        chosen = own
        if own is None and free:
            if len(free) > 1 or None in there:
                self._note_unclear(kind, stamp)
                return None
            chosen = free[0]
        kind.unclear_since = None
        kind.place = None if chosen is None else _place(chosen)
        kind.others = [_place(s) for s in candidates if s is not chosen]
        return chosen

    def _note_unclear(self, kind: _Kind, stamp: int) -> None:
        if kind.unclear_since is None:
            kind.unclear_since = stamp
        kind.lost = stamp - kind.unclear_since >= self._settle


class LostAmongSeveral:
    """Objects that were one of several things when a hand came, which may have taken any.

    Of those that are left none is surer than before. Only where colours are clipped: in others
    each of several has a name.
    """

    def __init__(self) -> None:
        self._one_of_several: set[int] = set()
        self._lost: set[int] = set()

    def update(
        self, named: Container[int], rest: Sequence[ObjectDetection], clipped: bool, limb: bool
    ) -> set[int]:
        """Take one frame; the lost objects, by catalogue index.

        named: objects that are told. rest: detections without a name. limb: whether a hand or an
        arm is in view.
        """
        if not clipped:
            self._one_of_several, self._lost = set(), set()
        elif limb:
            self._lost |= self._one_of_several
        else:
            counts = Counter(k for s in rest for k in possible(s.probability))
            self._one_of_several = {k for k, n in counts.items() if n > 1 and k not in named}
        return self._lost


def _place(s: ObjectDetection) -> Place:
    return s.shape.centroid[0], s.shape.centroid[1]


def _at(place: Place | None, candidates: list[ObjectDetection]) -> ObjectDetection | None:
    """What is at a place; None: nothing, or no place."""
    if place is None:
        return None
    away = [float(np.hypot(*np.subtract(place, _place(s)))) for s in candidates]
    nearest = int(np.argmin(away)) if away else -1
    return candidates[nearest] if away and away[nearest] < _SAME_PLACE else None
