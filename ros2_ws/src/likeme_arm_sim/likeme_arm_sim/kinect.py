"""Sensor model of a first-generation Kinect.

- Axial noise, sigma = 0.0012 + 0.0019 (z - 0.4)^2 m, and lateral noise of 0.8 px (0.83 px at 45
  degrees, 0.87 px at 60): Nguyen, Izadi and Lovell, "Modeling Kinect Sensor Noise for Improved 3D
  Reconstruction and Tracking", 3DIMPVT 2012, equations 1 and 2.
- Disparity in steps of 1/8 px over a baseline of 75 mm at a focal length of 586 px, 2.8 mm of
  depth at 1 m, growing with z^2: Khoshelham and Elberink, "Accuracy and Resolution of Kinect Depth
  Data for Indoor Mapping Applications", Sensors 12(2), 2012.
- No reading where the projector, 75 mm to the right of the camera, is hidden by something nearer,
  where a surface is seen at a grazing angle or across a depth edge, and out of range.

Depth is given in the colour camera's frame (registered), as the ROS driver publishes it.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_arm_sim.kinect_noise import Image32, KinectNoise, NoiseTiles
from likeme_arm_sim.renderer import Rendering
from likeme_core.camera_mount import CameraMount

# Greatest width of a shadow, f b / nearest, px.
REACH = 98
# Rows of the image in which edges are looked for at once.
BAND = 40


class RgbdImages(NamedTuple):
    """One frame of the sensor.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth_mm: (H, W) uint16, mm along the optical axis, 0 where there is no reading.
    """

    rgb: NDArray[np.uint8]
    depth_mm: NDArray[np.uint16]


def axial_sigma(depth: Image32, noise: KinectNoise) -> Image32:
    """Standard deviation of depth (H, W) seen head-on, m (Nguyen et al. 2012, equation 2)."""
    sigma = depth - np.float32(noise.axial_near)
    sigma *= sigma
    sigma *= np.float32(noise.axial_growth)
    sigma += np.float32(noise.axial_base)
    return sigma


def quantised(depth: Image32, noise: KinectNoise) -> Image32:
    """Depth (H, W), m, as its disparity f b / z rounded to the sensor's step gives it."""
    steps = np.float32(noise.focal_length * noise.baseline / noise.disparity_step)
    disparity = np.divide(steps, depth)
    np.rint(disparity, out=disparity)
    np.maximum(disparity, np.float32(1.0), out=disparity)
    return np.divide(steps, disparity, out=disparity)


def in_projector_shadow(depth: Image32, shift: float) -> NDArray[np.bool_]:
    """Where the projector's light does not reach, (H, W).

    The projector sees pixel u in its own column u - f b / z. Light arrives from the right, so a
    pixel is dark if some pixel further right lies in an earlier projector column.

    Args:
        depth: (H, W), m.
        shift: focal length times baseline, px m.
    """
    column = np.divide(np.float32(-shift), depth)
    column += np.arange(depth.shape[1], dtype=np.float32)
    # Running minimum from the right by doubling: after k steps a pixel knows 2^k - 1 neighbours.
    # Reading a neighbour that has been updated already is harmless, so this works in place.
    first, reach = column.copy(), 1
    while reach <= REACH:
        cv2.min(first[:, :-reach], first[:, reach:], dst=first[:, :-reach])
        reach *= 2
    return np.asarray(column > first)


def steepness(depth: Image32, focal_length: float) -> Image32:
    """Tangent of the angle of incidence, (H, W), from central differences; huge across edges."""
    slope = np.zeros(depth.shape, np.float32)
    cv2.absdiff(depth[:, 2:], depth[:, :-2], dst=slope[:, 1:-1])
    cv2.max(slope[1:-1], cv2.absdiff(depth[2:], depth[:-2]), dst=slope[1:-1])
    slope /= depth
    slope *= np.float32(focal_length / 2)
    return slope


class Kinect:
    """A depth sensor with a random stream of its own: same seed and frames, same images."""

    def __init__(
        self, camera: CameraMount, noise: KinectNoise | None = None, seed: int = 0
    ) -> None:
        self._camera = camera
        self._noise = noise or KinectNoise()
        self._tiles = NoiseTiles(camera, self._noise, np.random.default_rng(seed))
        # Of the last frame: ideal depth, where the projector's light does not reach, steepness.
        self._seen = np.full((camera.height, camera.width), np.nan, np.float32)
        self._dark = np.zeros(self._seen.shape, bool)
        self._steep = np.zeros_like(self._seen)

    def restart(self, seed: int) -> None:
        """Reseed the noise of the frames; the fixed noise of the sensor stays."""
        self._tiles.restart(np.random.default_rng(seed))

    def sense(self, rendering: Rendering) -> RgbdImages:
        """The measured frame of an ideal rendering."""
        expected = (self._camera.height, self._camera.width)
        if rendering.depth.shape != expected:
            got = 'x'.join(map(str, rendering.depth.shape))
            wanted = f'{self._camera.height}x{self._camera.width}'
            raise ValueError(f'Expected a depth of {wanted}, got {got}.')
        self._tiles.begin_frame()
        return RgbdImages(self._colour(rendering.rgb), self._depth(rendering.depth))

    def _colour(self, rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
        if self._noise.lens_blur > 0:
            rgb = cv2.GaussianBlur(rgb, (3, 3), self._noise.lens_blur).astype(np.uint8, copy=False)
        return self._tiles.grain(rgb)

    def _depth(self, ideal: Image32) -> NDArray[np.uint16]:
        noise = self._noise
        # Infinite depth would make differences NaN; out of range there is no reading anyway.
        depth = np.ascontiguousarray(np.minimum(ideal, np.float32(2 * noise.farthest)))
        self._update_edges(depth)
        lost = self._steep > self._tiles.steepest()
        lost |= self._dark
        measured = self._tiles.scatter(depth)
        deviation = axial_sigma(measured, noise)
        deviation *= self._tiles.axial()
        measured += deviation
        measured = quantised(measured, noise)
        lost |= measured < noise.nearest
        lost |= measured > noise.farthest
        measured *= np.float32(1000.0)
        measured += np.float32(0.5)
        measured *= ~lost
        return measured.astype(np.uint16)

    def _update_edges(self, depth: Image32) -> None:
        """Find shadow and steepness in those bands of the image that differ from the last one."""
        camera, shift = self._camera, self._camera.fx * self._noise.baseline
        for top in range(0, len(depth), BAND):
            # Steepness depends on the rows above and below.
            first, end = max(top - 1, 0), top + BAND
            if np.array_equal(depth[first : end + 1], self._seen[first : end + 1]):
                continue
            self._dark[top:end] = in_projector_shadow(depth[top:end], shift)
            steep = steepness(depth[first : end + 1], camera.fx)
            self._steep[top:end] = steep[top - first :][:BAND]
        self._seen = depth
