"""Light: the table's own colour tells how much brighter or more tinted it is than at teaching.

Where the table saturates, places that are darker than it tell the light instead.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

ImageB = NDArray[np.uint8]
Index = NDArray[np.intp]
Rgb = tuple[float, float, float]
Caps = tuple[int, int, int]

# Within this relative difference colours are taken as they are: the mixtures of the catalogue are
# broader (5 of 128 steps of a and b).
_TOLERANCE = 0.1
# A channel at this value or above is saturated.
_SATURATED = 250.0
# Below this share of the taught light a step of 8 bits is over 10 % of a usual colour.
_DARKEST = 0.04
# A light that is told by darker places is told in steps of this ratio.
_STEP = 1.02

#: Reasons why colours cannot be told.
TOO_DARK, OVEREXPOSED = 'image too dark', 'image overexposed'


class Light(NamedTuple):
    """Each channel's factor over the taught light; why colours cannot be told, if they cannot.

    clipped: the table saturates, and so may objects: see `caps`.
    """

    factor: Rgb
    reason: str = ''
    clipped: bool = False

    @property
    def usual(self) -> bool:
        """Whether colours are as they were taught."""
        return max(abs(f - 1) for f in self.factor) <= _TOLERANCE

    @property
    def caps(self) -> Caps:
        """What `as_taught` makes of a saturated value, in each channel."""
        red, green, blue = (int(v) for v in _table_of(self)[0, -1])
        return red, green, blue


#: The light in which the looks were measured.
TAUGHT = Light((1.0, 1.0, 1.0))


def table_colour(rgb: ImageB, pixels: Index) -> Rgb:
    """The median RGB of some pixels (flat indices) that show the table."""
    red, green, blue = np.median(rgb.reshape(-1, 3)[pixels], axis=0)
    return float(red), float(green), float(blue)


def light_of(seen: Rgb, taught: Rgb) -> Light:
    """The light on a table of a taught colour.

    A saturated channel tells a lower bound. One more channel than the others may be saturated if
    the light that the rest shows explains it without a tint.
    """
    factor = [max(s, 0.5) / max(t, 1.0) for s, t in zip(seen, taught, strict=True)]
    clear = [f for f, s, t in zip(factor, seen, taught, strict=True) if s < max(_SATURATED, t)]
    if max(factor) < _DARKEST:
        return Light((factor[0], factor[1], factor[2]), TOO_DARK)
    if not clear or (max(clear) < max(factor) - _TOLERANCE and max(seen) >= _SATURATED):
        return Light((factor[0], factor[1], factor[2]), OVEREXPOSED)
    brightest = max(clear)
    red, green, blue = (
        f if s < max(_SATURATED, t) else max(f, brightest)
        for f, s, t in zip(factor, seen, taught, strict=True)
    )
    light = Light((red, green, blue))
    return light._replace(clipped=len(clear) < 3 and not light.usual)


def clipped_light(factor: Rgb) -> Light:
    """A light in which the table saturates; in steps, since each has its own looks of objects."""
    red, green, blue = (_STEP ** round(np.log(f) / np.log(_STEP)) for f in factor)
    return Light((red, green, blue), clipped=True)


def agree(light: Light, seen: Rgb, taught: Rgb) -> bool:
    """Whether a table of a taught colour would be seen so under a light."""
    return all(
        abs(min(255.0, f * t) - s) <= _TOLERANCE * s
        for f, s, t in zip(light.factor, seen, taught, strict=True)
    )


def as_taught(rgb: ImageB, light: Light) -> ImageB:
    """Colours (H, W, 3) as they would be under the taught light."""
    if light.usual or light.reason:
        return rgb
    return np.asarray(cv2.LUT(rgb, _table_of(light)), np.uint8)


def _table_of(light: Light) -> ImageB:
    """Look-up table of the colours as taught, (1, 256, 3)."""
    red, green, blue = (max(round(f, 2), 0.01) for f in light.factor)
    return _correction(red, green, blue)


@lru_cache(maxsize=32)
def _correction(red: float, green: float, blue: float) -> ImageB:
    """Look-up table of the inverse factors, (1, 256, 3)."""
    values = np.arange(256)[:, None] / np.array([red, green, blue])
    return np.asarray(np.clip(np.rint(values), 0, 255), np.uint8)[None]
