"""Regions of the table and the paper's centroid rule (section "Sensing")."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from likeme_core.geometry import Area, Rectangle
from likeme_core.tabletop import State


@dataclass(frozen=True)
class Regions:
    """What the states mean on the table plane.

    Attributes:
        areas: of each state by its number; None for the one state that is everywhere else.
        states: in the order of their numbers.
        fallen_depth: a centroid lower than this below the table top (m) is elsewhere.
    """

    states: tuple[State, ...]
    areas: tuple[Area | None, ...]
    fallen_depth: float = 0.03

    @cached_property
    def elsewhere(self) -> State:
        """The state of an object in none of the areas."""
        return self.states[self.areas.index(None)]

    @cached_property
    def work_area(self) -> Rectangle:
        """The smallest rectangle around all areas, m."""
        bounds = [area.bounds for area in self.areas if area is not None]
        return Rectangle(
            min(b.x_min for b in bounds),
            max(b.x_max for b in bounds),
            min(b.y_min for b in bounds),
            max(b.y_max for b in bounds),
        )

    def state_of(self, x: float, y: float, z: float = 0.0) -> State:
        """State of an object with this centroid (m). A shared edge belongs to the later area."""
        if not z < -self.fallen_depth:
            for state, area in zip(reversed(self.states), reversed(self.areas), strict=True):
                if area is not None and area.contains(x, y):
                    return state
        return self.elsewhere
