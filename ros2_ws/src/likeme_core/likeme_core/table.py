"""The table between robot and person (Fig 2a)."""

from __future__ import annotations

from dataclasses import dataclass

from likeme_core.geometry import Rectangle
from likeme_core.regions import Regions
from likeme_core.tabletop import State


@dataclass(frozen=True)
class Table:
    """A slab whose top is z = 0 in base_link, m.

    The work area is the part of the top that counts as LEFT or RIGHT; the blue line divides it.
    What has its centroid lower than the slab is thick has fallen off it.
    """

    top: Rectangle = Rectangle(0.22, 0.66, -0.38, 0.38)
    work_area: Rectangle = Rectangle(0.27, 0.61, -0.33, 0.33)
    blue_line_y: float = 0.0
    blue_line_width: float = 0.012
    thickness: float = 0.03
    floor_z: float = -0.20

    @property
    def regions(self) -> Regions:
        """LEFT, RIGHT and OFFTABLE on this table."""
        return Regions(self.work_area, self.blue_line_y, self.thickness)

    def state_of(self, x: float, y: float, z: float = 0.0) -> State:
        """State of an object by its centroid (m): the centroid rule."""
        return self.regions.state_of(x, y, z)
