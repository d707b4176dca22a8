"""Demonstrations and table states for session tests; stamps in seconds."""

from __future__ import annotations

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.paper_world import RIGHT, WORLD
from likeme_core.tabletop import Manner, State


def ns(seconds: float) -> int:
    """Nanoseconds of seconds."""
    return round(seconds * 1e9)


def shown(
    name: str, x_i: State, x_f: State, at: float, manner: Manner = Manner.PLACE
) -> Demonstration:
    """Make an act of two seconds that was found complete at a stamp."""
    return Demonstration(ns(at), 'camera', name, x_i, x_f, manner, ns(at - 2), ns(at - 0.1))


def table(at: float, settled: bool = True, **states: State) -> TableSnapshot:
    """Make a view of all objects, RIGHT unless said otherwise."""
    everything = dict.fromkeys(WORLD.objects, RIGHT) | states
    return TableSnapshot(ns(at), 'camera', settled, everything)
