"""Tip of a hand: stands in for an object that the hand hides while carrying it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_perception.background import Background
from likeme_perception.blobs import Blob
from likeme_perception.entry_side import nearest_side

# Length (m) of the tip, from the point farthest from the entry side.
_TIP_LENGTH = 0.08


class HandTip(NamedTuple):
    """Tip of a hand over the table, m: mean x and y; low: 10th percentile of its height."""

    x: float
    y: float
    low: float


def hand_tip(hand: Blob, background: Background, sides: tuple[str, ...]) -> HandTip | None:
    """The tip, as the part over the table farthest from the entry side; None if there is none."""
    x, y, _ = hand.xyz
    over = background.area.contains(x, y)
    if np.count_nonzero(over) < 20:
        return None
    side = nearest_side(hand.xyz, background.area, sides)
    x, y, z = hand.xyz[:, over]
    ahead = {'near': x, 'far': -x, 'left': -y, 'right': y}[side]
    tip = ahead > np.percentile(ahead, 99.5) - _TIP_LENGTH
    return HandTip(float(x[tip].mean()), float(y[tip].mean()), float(np.percentile(z[tip], 10)))
