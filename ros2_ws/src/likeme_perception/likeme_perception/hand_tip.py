"""The foremost part of a hand: what stands for the whole while it hides what it carries."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_perception.background import Background
from likeme_perception.entry_side import nearest_side
from likeme_perception.segmentation import Blob

# The tip of a hand: this much (m) of it from its farthest point.
_TIP = 0.08


class HandTip(NamedTuple):
    """The foremost part of a hand over the table: x, y and low (10th percentile of height), m."""

    x: float
    y: float
    low: float


def hand_tip(hand: Blob, background: Background, sides: tuple[str, ...]) -> HandTip | None:
    """Where the hand's foremost part over the table is; the side it came in over is behind it."""
    x, y, _ = hand.xyz
    over = background.area.contains(x, y)
    if np.count_nonzero(over) < 20:
        return None
    side = nearest_side(hand.xyz, background.area, sides)
    x, y, z = hand.xyz[:, over]
    ahead = {'near': x, 'far': -x, 'left': -y, 'right': y}[side]
    tip = ahead > np.percentile(ahead, 99.5) - _TIP
    return HandTip(float(x[tip].mean()), float(y[tip].mean()), float(np.percentile(z[tip], 10)))
