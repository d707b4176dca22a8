"""The table between robot and person (Fig 2a)."""

from __future__ import annotations

from dataclasses import dataclass

from likeme_core.geometry import Rectangle

Colour = tuple[int, int, int]


@dataclass(frozen=True)
class PaintedLine:
    """A straight line on the table top, as the paper's blue line.

    start, end: (x, y), m. width: m. colour: RGB.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    width: float
    colour: Colour


@dataclass(frozen=True)
class DarkPlace:
    """A place in view that does not move and is darker than the table.

    at: (x, y, z) on its surface, m. colour: RGB in the images that the looks were measured in.
    """

    at: tuple[float, float, float]
    colour: tuple[float, float, float]


@dataclass(frozen=True)
class Table:
    """A slab with its top at z = 0 in base_link, m; an object with its centroid below has fallen.

    lines: drawn on the top by the simulator; perception does not need them. colour: RGB of the
    bare top in the images that the objects' looks were measured in; None: not known. dark: tell
    the light where the table saturates.
    """

    top: Rectangle
    thickness: float
    floor_z: float
    lines: tuple[PaintedLine, ...] = ()
    colour: tuple[float, float, float] | None = None
    dark: tuple[DarkPlace, ...] = ()
