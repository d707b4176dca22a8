"""Objects on the table that have no name of the world, followed from frame to frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from likeme_core.stamps import nanoseconds
from likeme_perception.blobs import Index
from likeme_perception.top_view import Shape

# An object that moved less than this, m, since it was last seen keeps its name.
_NEAR = 0.05


class UnknownObject(NamedTuple):
    """An object that is none of the catalogue's, or one of several of a kind.

    name: "unknown_1", or "lemon_2" if it fits the lemon. fits: that object's name; empty if none.
    probability: that it is none of the catalogue's. pixels: flat indices (N,).
    """

    name: str
    fits: str
    probability: float
    pixels: Index
    shape: Shape


class _Named(NamedTuple):
    """A name that is in use: where it was last seen, and when."""

    name: str
    place: tuple[float, float]
    stamp: int


class UnknownObjectNames:
    """Names unknown objects so that each keeps its name from frame to frame.

    A name becomes free when its object has not been seen for `absence_time` without hand and arm.
    """

    def __init__(self, absence_time: float) -> None:
        self._absence = nanoseconds(absence_time)
        self._used: dict[str, _Named] = {}
        self._clear_since: int | None = None

    def named(
        self, found: Sequence[UnknownObject], stamp: int, limb: bool, taken: frozenset[str]
    ) -> tuple[UnknownObject, ...]:
        """The objects with their names.

        limb: whether a hand or an arm is in view. taken: objects of the catalogue that are told
        from those that fit them too: they are the first of their kind.
        """
        named: dict[int, str] = {}
        for k, name in self._followed(found):
            if k not in named and name not in named.values():
                named[k] = name
        for k, each in enumerate(found):
            if k not in named:
                named[k] = self._new_name(each.fits, set(named.values()), each.fits in taken)
        for k, each in enumerate(found):
            x, y, _ = each.shape.centroid
            self._used[named[k]] = _Named(named[k], (x, y), stamp)
        self._forget(stamp, limb)
        return tuple(each._replace(name=named[k]) for k, each in enumerate(found))

    def _followed(self, found: Sequence[UnknownObject]) -> list[tuple[int, str]]:
        """Pairs of an object and a name for the same kind of thing, nearest first."""
        pairs = []
        for k, each in enumerate(found):
            for used in self._used.values():
                away = float(np.hypot(*np.subtract(used.place, each.shape.centroid[:2])))
                if away < _NEAR and used.name.rpartition('_')[0] == (each.fits or 'unknown'):
                    pairs.append((away, k, used.name))
        return [(k, name) for _, k, name in sorted(pairs)]

    def _new_name(self, fits: str, others: set[str], first_is_taken: bool) -> str:
        number = 2 if first_is_taken else 1
        while (name := f'{fits or "unknown"}_{number}') in others | self._used.keys():
            number += 1
        return name

    def _forget(self, stamp: int, limb: bool) -> None:
        if limb:
            self._clear_since = None
            return
        if self._clear_since is None:
            self._clear_since = stamp
        since = self._clear_since
        self._used = {
            name: used
            for name, used in self._used.items()
            if stamp - max(used.stamp, since) <= self._absence
        }
