"""The foremost part of a hand: what stands for the whole while it hides what it carries."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_perception.background import Background
from likeme_perception.segmentation import Index
from likeme_perception.sides import nearest_side

ImageF = NDArray[np.float32]

# The tip of a hand: this much (m) of it from its farthest point.
_TIP = 0.08


class HandTip(NamedTuple):
    """The foremost part of a hand over the table: x, y and low (10th percentile of height), m."""

    x: float
    y: float
    low: float


def hand_tip(
    pixels: Index, depth: ImageF, background: Background, sides: tuple[str, ...]
) -> HandTip | None:
    """Where the hand's foremost part over the table is; the side it came in over is behind it."""
    points = background.view.points(pixels, depth.ravel()[pixels])
    over = background.area.contains(points[:, 0], points[:, 1])
    if np.count_nonzero(over) < 20:
        return None
    side = nearest_side(points, background.area, sides)
    inwards = {'near': (1, 0), 'far': (-1, 0), 'left': (0, -1), 'right': (0, 1)}[side]
    ahead = points[over] @ np.array([*inwards, 0], np.float32)
    tip = points[over][ahead > np.percentile(ahead, 99.5) - _TIP]
    return HandTip(
        float(tip[:, 0].mean()), float(tip[:, 1].mean()), float(np.percentile(tip[:, 2], 10))
    )
