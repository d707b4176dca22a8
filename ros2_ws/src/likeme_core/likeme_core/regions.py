"""The table's regions and the paper's centroid rule (section "Sensing")."""

from __future__ import annotations

from dataclasses import dataclass

from likeme_core.geometry import Rectangle
from likeme_core.tabletop import State


@dataclass(frozen=True)
class Regions:
    """The work area, split by the blue line: LEFT is y > blue_line_y.

    fallen_depth: a centroid this far below the table (m) is OFFTABLE wherever it is.
    """

    work_area: Rectangle
    blue_line_y: float
    fallen_depth: float = 0.03

    def state_of(self, x: float, y: float, z: float = 0.0) -> State:
        """State of an object by its centroid (m): the centroid rule."""
        if z < -self.fallen_depth or not self.work_area.contains(x, y):
            return State.OFFTABLE
        return State.LEFT if y > self.blue_line_y else State.RIGHT
