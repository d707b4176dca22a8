"""Side of the table over which a hand or an arm enters: near, far, left or right."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from likeme_core.geometry import Rectangle

ImageF = NDArray[np.float32]

# A blob that extends this far (m) beyond the table's edge, at its height, does not lie on it.
_REACH = 0.06
# Least area (m^2) visible beyond that distance.
_REACH_AREA = 0.0003


def entry_sides(
    xyz: ImageF, area: ImageF, table: Rectangle, floor: float, sides: tuple[str, ...]
) -> frozenset[str]:
    """Those of some sides of the table that points (3, N) extend over.

    area: visible surface of each point, m^2. floor: points lower than this are ignored.
    """
    x, y, z = xyz
    beyond = {
        'near': table.x_min - x,
        'far': x - table.x_max,
        'left': y - table.y_max,
        'right': table.y_min - y,
    }
    level = z > floor
    return frozenset(
        side for side in sides if area[level & (beyond[side] > _REACH)].sum() > _REACH_AREA
    )


def nearest_side(xyz: ImageF, table: Rectangle, sides: tuple[str, ...]) -> str:
    """The one of some sides of the table that points (3, N) are closest to."""
    x, y, _ = xyz
    gap = {
        'near': float(x.min()) - table.x_min,
        'far': table.x_max - float(x.max()),
        'left': table.y_max - float(y.max()),
        'right': float(y.min()) - table.y_min,
    }
    return min(sides, key=lambda s: gap[s])
