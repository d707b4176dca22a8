"""Colour models of objects as they look where a camera saturates."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.colour import (
    BINS,
    FLOOR_LOG_DENSITY,
    UNKNOWN_LOG_DENSITY,
    Bins,
    ColourComponent,
    LogDensity,
    bins_of_lab,
    mixture_density,
)
from likeme_perception.light import Caps

Floats = NDArray[np.float64]

# Steps of L, a and b in which colours are sampled: a quarter and a half of a bin.
_STEPS = (3.125, 2.0, 2.0)


def clipped_log_density(mixtures: Sequence[tuple[ColourComponent, ...]], caps: Caps) -> LogDensity:
    """log p(colour) at each bin of colours that are cut off at `caps`, (mixtures, BINS).

    Cutting off maps many colours to one. Both the mixture's mass and that of an unknown colour,
    which is uniform, move with them; what counts is their ratio, here over UNKNOWN_LOG_DENSITY:

        log p(bin | mixture) - log p(bin | unknown) + UNKNOWN_LOG_DENSITY

    A mixture counts where an RGB image can have its colours, with its mass there as 1: bright
    colours have much of it elsewhere.
    """
    lab, rgb = _colours()
    seen = np.minimum(rgb, np.asarray(caps, np.uint8))
    bins = bins_of_lab(cv2.cvtColor(seen[None], cv2.COLOR_RGB2LAB)[0])
    unknown = _mass(bins, np.full(len(lab), np.exp(UNKNOWN_LOG_DENSITY)))
    density = np.stack([mixture_density(parts, lab) for parts in mixtures])
    density /= density.sum(axis=1, keepdims=True) * np.prod(_STEPS)
    found = np.stack([_mass(bins, each) for each in density])
    with np.errstate(divide='ignore', invalid='ignore'):
        ratio = np.log(found / unknown) + UNKNOWN_LOG_DENSITY
    return np.fmax(ratio, FLOOR_LOG_DENSITY).astype(np.float32)


@lru_cache(maxsize=1)
def _colours() -> tuple[Floats, NDArray[np.uint8]]:
    """Evenly spaced colours in CIELAB units that an RGB image can have, (N, 3), and their RGB."""
    light = np.arange(_STEPS[0] / 2, 100.0, _STEPS[0])
    chroma = np.arange(-127.0, 128.0, _STEPS[1])
    lab = np.stack(np.meshgrid(light, chroma, chroma, indexing='ij'), -1).reshape(-1, 3)
    rgb = cv2.cvtColor(lab[None].astype(np.float32), cv2.COLOR_LAB2RGB)
    back = cv2.cvtColor(rgb, cv2.COLOR_RGB2LAB)[0]
    real = np.abs(back - lab).max(axis=1) < 1.0
    return lab[real], np.rint(255 * rgb[0][real]).astype(np.uint8)


def _mass(bins: Bins, density: Floats) -> Floats:
    """Mass of colours by bin, (BINS,), smoothed over neighbouring ones in a and b."""
    cube = np.bincount(bins, density, minlength=BINS).reshape(8, 64, 64)
    blurred = [cv2.GaussianBlur(level, (3, 3), 0.7) for level in cube]
    return np.asarray(np.stack(blurred), np.float64).ravel()
