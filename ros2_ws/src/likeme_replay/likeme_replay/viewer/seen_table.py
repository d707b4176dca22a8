"""What perception saw in one frame, of a message or of perception in this process."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from likeme_core.stamps import stamp_ns
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.top_view import Shape
from likeme_perception.unknown_objects import UnknownObject


class SeenObject(NamedTuple):
    """One object of the world, or one that is none of them.

    Attributes:
        state: number of its region; None: unknown.
        probabilities: of the regions by their numbers; empty where there are none.
        shape: as last seen, in base_link; None: never seen.
        visible: in this very frame.
    """

    name: str
    state: int | None
    probabilities: tuple[float, ...]
    shape: Shape | None
    visible: bool


class SeenTable(NamedTuple):
    """One frame; `stamp` in ns. reason: why nothing can be said of it; empty: it was read."""

    stamp: int
    hand_in_view: bool
    reason: str
    objects: tuple[SeenObject, ...]
    unknown_objects: tuple[SeenObject, ...]


def of_message(message: Any, regions: int) -> SeenTable:
    """A TableState of any library, in a world with so many regions."""
    return SeenTable(
        stamp_ns(message.header.stamp),
        bool(message.hand_in_view),
        str(message.reason),
        tuple(_of_state(each, regions) for each in message.objects),
        tuple(
            SeenObject(each.name, None, (), _of_fields(each), True)
            for each in message.unknown_objects
        ),
    )


def of_observation(table: TableObservation) -> SeenTable:
    """An observation of perception."""
    return SeenTable(
        table.stamp,
        table.hand_in_view,
        table.reason,
        tuple(map(_of_observed, table.objects)),
        tuple(map(_of_unknown, table.unknown_objects)),
    )


def _of_state(message: Any, regions: int) -> SeenObject:
    state = int(message.state)
    return SeenObject(
        message.name,
        state if state < regions else None,
        tuple(map(float, message.state_probability)),
        _of_fields(message),
        bool(message.visible),
    )


def _of_fields(message: Any) -> Shape | None:
    at = message.centroid
    if not math.isfinite(at.x):
        return None
    return Shape(
        (at.x, at.y, at.z),
        message.major_axis_yaw,
        message.major_axis_length,
        message.minor_axis_length,
        message.height,
    )


def _of_observed(seen: ObjectObservation) -> SeenObject:
    state = None if seen.state is None else int(seen.state)
    return SeenObject(seen.name, state, tuple(seen.state_probability), seen.shape, seen.visible)


def _of_unknown(seen: UnknownObject) -> SeenObject:
    return SeenObject(seen.name, None, (), seen.shape, True)
