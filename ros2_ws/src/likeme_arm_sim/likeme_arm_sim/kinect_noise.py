"""Noise of the Kinect: its parameters, and precomputed noise images."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.camera_mount import CameraMount

Image32 = NDArray[np.float32]


@dataclass(frozen=True)
class KinectNoise:
    """Parameters of the sensor model; the defaults are the published ones.

    Attributes:
        axial_base, axial_growth: sigma = base + growth (z - axial_near)^2, m and 1/m.
        axial_near: m.
        axial_correlation: reach over which neighbours share noise, px: the matching window.
        lateral: standard deviation of where a pixel looks, px.
        baseline: camera to projector, m.
        focal_length: of the infrared camera, px.
        disparity_step: px.
        grazing_from, grazing_to: incidence between which a reading becomes unlikely, rad.
        grazing_loss: share of readings that are lost at grazing incidence and across edges.
        speckle_loss: share of readings that are missing regardless of incidence.
        nearest, farthest: range, m.
        colour: standard deviation of each colour channel, 8-bit steps.
        lens_blur: standard deviation of the point spread, px; 0 for none.
        patterns: number of noise images that are repeated in turn, so that static scenes
            compress; 0: independent noise in every frame.
    """

    axial_base: float = 0.0012
    axial_growth: float = 0.0019
    axial_near: float = 0.4
    axial_correlation: float = 0.7
    lateral: float = 0.8
    baseline: float = 0.075
    focal_length: float = 586.0
    disparity_step: float = 0.125
    grazing_from: float = float(np.radians(70.0))
    grazing_to: float = float(np.radians(84.0))
    grazing_loss: float = 0.75
    speckle_loss: float = 0.001
    nearest: float = 0.4
    farthest: float = 4.0
    colour: float = 2.0
    lens_blur: float = 0.6
    patterns: int = 0


class NoiseTiles:
    """Noise drawn once, larger than the image, and read at a new random offset per frame.

    Fresh normal numbers for 300,000 pixels would cost more than the whole frame. A pixel meets one
    of `MARGIN`^2 = 16,384 samples, independently from frame to frame, so its statistics over time
    and over neighbours are those of fresh noise; a pattern repeats only where two frames happen
    to draw the same offset, minutes apart on average.
    """

    MARGIN = 128
    LATERAL_MAPS = 16

    def __init__(self, camera: CameraMount, noise: KinectNoise, rng: np.random.Generator) -> None:
        self._rng, self._frames = rng, 0
        self._patterns = rng.integers(0, 2**32, noise.patterns) if noise.patterns else None
        self._shape = camera.height, camera.width
        size = camera.height + self.MARGIN, camera.width + self.MARGIN
        self._axial = _correlated(rng.standard_normal(size), noise.axial_correlation)
        span = np.tan(noise.grazing_to) - np.tan(noise.grazing_from)
        limit = np.tan(noise.grazing_from) + span * rng.random(size)
        limit[rng.random(size) > noise.grazing_loss] = np.inf
        limit[rng.random(size) < noise.speckle_loss] = -1.0
        self._limit = limit.astype(np.float32)
        grain = np.rint(rng.normal(0.0, noise.colour, (*size, 3)))
        self._lighter = np.maximum(grain, 0).astype(np.uint8)
        self._darker = np.maximum(-grain, 0).astype(np.uint8)
        self._unused = np.empty(0, np.uint16)
        self._lateral = [
            _scattered(self._shape, noise.lateral, rng) for _ in range(self.LATERAL_MAPS)
        ]

    def restart(self, rng: np.random.Generator) -> None:
        """Draw offsets by `rng` from now on; the noise images stay."""
        self._rng, self._frames = rng, 0

    def begin_frame(self) -> None:
        """Start a frame; with `patterns`, choose its noise image."""
        if self._patterns is not None:
            pattern = self._patterns[self._frames % len(self._patterns)]
            self._rng, self._frames = np.random.default_rng(pattern), self._frames + 1

    def _window(self) -> tuple[slice, slice]:
        top, left = self._rng.integers(0, self.MARGIN, 2)
        return slice(top, top + self._shape[0]), slice(left, left + self._shape[1])

    def axial(self) -> Image32:
        """Standard normal numbers, (H, W)."""
        return np.asarray(self._axial[self._window()])

    def steepest(self) -> Image32:
        """The tangent of incidence up to which each pixel still gets a reading, (H, W)."""
        return np.asarray(self._limit[self._window()])

    def grain(self, rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The image with the colour noise added, (H, W, 3)."""
        window = self._window()
        lighter = cv2.add(rgb, self._lighter[window])
        return np.asarray(cv2.subtract(lighter, self._darker[window], dst=lighter))

    def scatter(self, depth: Image32) -> Image32:
        """The depth image with each pixel looking a little beside itself, (H, W)."""
        places = self._lateral[int(self._rng.integers(len(self._lateral)))]
        nearest, border = cv2.INTER_NEAREST, cv2.BORDER_REPLICATE
        return np.asarray(cv2.remap(depth, places, self._unused, nearest, borderMode=border))


def _correlated(white: NDArray[np.float64], reach: float) -> Image32:
    """White noise blurred over `reach` px, of unit variance again."""
    smooth = cv2.GaussianBlur(white, (0, 0), reach) if reach > 0 else white
    return np.asarray(smooth / smooth.std(), np.float32)


def _scattered(
    shape: tuple[int, int], sigma: float, rng: np.random.Generator
) -> NDArray[np.int16]:
    """Per pixel the (u, v) it looks at, (H, W, 2), for cv2.remap."""
    v, u = np.indices(shape)
    places = np.stack([u, v], axis=2) + rng.normal(0.0, sigma, (*shape, 2))
    return np.rint(places).astype(np.int16)
