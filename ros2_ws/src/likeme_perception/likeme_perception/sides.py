"""Over which side of the table something reaches in: near, far, left or right of the robot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from likeme_core.geometry import Rectangle

ImageF = NDArray[np.float32]

# What reaches this far (m) beyond the table's edge at table height is no thing that lies on it.
_REACH = 0.06
# Area (m^2) that must be seen beyond that.
_REACH_AREA = 0.0003


def sides_reached(
    xyz: ImageF,
    area: ImageF,
    table: Rectangle,
    floor: float,
    sides: tuple[str, ...],
) -> frozenset[str]:
    """Over which of some sides of the table points (3, N) reach in.

    area: seen surface of each point, m^2. floor: points lower than this lie beside the table.
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
    """Which of some sides of the table points (3, N) come closest to."""
    x, y, _ = xyz
    gap = {
        'near': float(x.min()) - table.x_min,
        'far': table.x_max - float(x.max()),
        'left': table.y_max - float(y.max()),
        'right': float(y.min()) - table.y_min,
    }
    return min(sides, key=lambda s: gap[s])
