"""Colour models in CIELAB as look-up tables: Gaussian mixture, and histogram learned online."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

ImageB = NDArray[np.uint8]
Index = NDArray[np.intp]
Bins = NDArray[np.int32]
LogDensity = NDArray[np.float32]

# Bins of L, a and b. L is coarse, since light and shade change it.
_LEVELS = (8, 64, 64)
_VOLUME = (100 / 8) * 4.0 * 4.0
BINS = 8 * 64 * 64
# Log density of an unknown colour: uniform over the part of CIELAB that objects use.
UNKNOWN_LOG_DENSITY = -float(np.log(100.0 * 120.0 * 120.0))
# Lower bound of log densities: highlights and mixed pixels at edges fit no model.
FLOOR_LOG_DENSITY = UNKNOWN_LOG_DENSITY - 4.0


@dataclass(frozen=True)
class ColourComponent:
    """One Gaussian: weight, mean (L, a, b) and standard deviations, in CIELAB units."""

    weight: float
    mean: tuple[float, float, float]
    deviation: tuple[float, float, float]


def colour_bins(rgb: ImageB, pixels: Index) -> Bins:
    """Histogram bin of each pixel (flat indices), (N,)."""
    if len(pixels) == 0:
        return np.zeros(0, np.int32)
    return bins_of_lab(lab_at(rgb, pixels))


def lab_at(rgb: ImageB, pixels: Index) -> ImageB:
    """Colours of one pixel or more (flat indices) in OpenCV's 8-bit CIELAB, (N, 3)."""
    flat = (
        rgb.reshape(-1, 3).take(pixels, axis=0)
        if rgb.flags.c_contiguous
        else rgb[np.unravel_index(pixels, rgb.shape[:2])]
    )
    return cast(ImageB, cv2.cvtColor(flat[None], cv2.COLOR_RGB2LAB)[0])


def bins_of_lab(lab: ImageB) -> Bins:
    """Histogram bin of colours (N, 3) in OpenCV's 8-bit CIELAB."""
    light, a, b = np.ascontiguousarray(lab.T).astype(np.int32)
    return cast(Bins, (light >> 5) << 12 | (a >> 2) << 6 | b >> 2)


@lru_cache(maxsize=1)
def _bin_centres() -> NDArray[np.float64]:
    """(L, a, b) at the middle of each bin, (BINS, 3), in CIELAB units."""
    light, a, b = np.meshgrid(*(np.arange(n) for n in _LEVELS), indexing='ij')
    return np.stack([(light + 0.5) * 12.5, a * 4 + 2 - 128.0, b * 4 + 2 - 128.0], -1).reshape(
        -1, 3
    )


def mixture_log_density(parts: tuple[ColourComponent, ...]) -> LogDensity:
    """log p(colour) of a Gaussian mixture at each bin, (BINS,).

    See mixture_density.
    """
    with np.errstate(divide='ignore'):
        log_density = np.log(mixture_density(parts, _bin_centres()))
    return np.maximum(log_density, FLOOR_LOG_DENSITY).astype(np.float32)


def mixture_density(
    parts: tuple[ColourComponent, ...], lab: NDArray[np.float64]
) -> NDArray[np.float64]:
    """p(colour) of a Gaussian mixture at colours (N, 3), CIELAB units.

    Deviations are at least 12 in L and 5 in a and b, since another lamp or white balance shifts
    every colour.
    """
    density = np.zeros(len(lab))
    for part in parts:
        deviation = np.maximum(part.deviation, (12.0, 5.0, 5.0))
        distance = ((lab - part.mean) / deviation) ** 2
        norm = (2 * np.pi) ** 1.5 * deviation.prod()
        density += part.weight * np.exp(-0.5 * distance.sum(axis=1)) / norm
    return density


def mixture_of(lab: NDArray[np.float64], parts: int = 3) -> tuple[ColourComponent, ...]:
    """Fit a mixture to colours (N, 3), CIELAB units: k-means, then one Gaussian per cluster."""
    if len(lab) < 20:
        raise ValueError(f'Expected at least 20 pixels to learn a colour, got {len(lab)}.')
    scaled = (lab * (0.4, 1.0, 1.0)).astype(np.float32)
    cv2.setRNGSeed(0)
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 0.1)
    _, label, _ = cv2.kmeans(scaled, parts, np.zeros(0, np.int32), stop, 3, cv2.KMEANS_PP_CENTERS)
    found = []
    for k in range(parts):
        cluster = lab[label.ravel() == k]
        if len(cluster) < 0.03 * len(lab):
            continue
        mean, deviation = cluster.mean(axis=0), cluster.std(axis=0)
        found.append(
            ColourComponent(round(len(cluster) / len(lab), 3), _triple(mean), _triple(deviation))
        )
    return tuple(sorted(found, key=lambda part: -part.weight))


def _triple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    return round(float(values[0]), 1), round(float(values[1]), 1), round(float(values[2]), 1)


class ColourHistogram:
    """A colour histogram with exponential forgetting of older frames."""

    def __init__(self, keep: float = 0.9, prior: float = 300.0) -> None:
        self._keep = keep
        self._prior = prior
        self._count = np.zeros(BINS, np.float32)
        self._log: LogDensity | None = None

    @property
    def known(self) -> bool:
        """Whether it holds enough pixels to be used."""
        return float(self._count.sum()) > 200

    def update(self, bins: Bins) -> None:
        """Add the colours of one frame."""
        count = np.bincount(bins, minlength=BINS).astype(np.float32)
        self._count = self._keep * self._count + count
        self._log = None

    @property
    def log_density(self) -> LogDensity:
        """log p(colour) at each bin, smoothed over neighbouring bins, with a uniform prior."""
        if self._log is None:
            cube = self._count.reshape(_LEVELS[0], _LEVELS[1], _LEVELS[2])
            smooth = np.stack([cv2.GaussianBlur(level, (5, 5), 1.2) for level in cube])
            smooth[1:-1] = 0.25 * smooth[:-2] + 0.5 * smooth[1:-1] + 0.25 * smooth[2:]
            density = smooth.ravel() / _VOLUME + self._prior * np.exp(UNKNOWN_LOG_DENSITY)
            density /= float(self._count.sum()) + self._prior
            self._log = np.maximum(np.log(density), FLOOR_LOG_DENSITY).astype(np.float32)
        return self._log
