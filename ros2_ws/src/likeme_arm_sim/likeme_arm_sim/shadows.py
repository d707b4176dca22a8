"""Soft shadows of convex bodies on a horizontal surface, as the camera sees them.

A convex part's shadow is the hull of its vertices' shadows, and projection keeps it convex: one
small filled polygon per part, blurred. This is an approximation for appearance only: the
shadow fades with the part's height above the surface, and bodies do not shade each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_arm_sim.meshes import ConvexMesh, Floats
from likeme_core.camera_mount import CameraMount

# Shadows are drawn at a quarter of the image's resolution: they are blurred by more than that.
COARSE = 4
DARKEST, FADING = 105.0, 0.16
# Below this height, m, a part touches or nearly so, and its shadow has a crisp edge.
CONTACT = 0.05
# Standard deviation of the one, and width of the box blurred with twice for the other, coarse px.
CRISP, WIDE = 1.2, 9
# Number of outlines that are kept: bodies often are where they were.
KEPT = 256


class SoftShadows:
    """Darkens the pixels of one horizontal surface where moving bodies keep the light away."""

    def __init__(
        self, camera: CameraMount, light: Floats, height: float, surface: NDArray[np.bool_]
    ) -> None:
        """Shadows on the plane z = `height`, m, seen at the pixels `surface` (H, W).

        `light` (3,) points from the surface to the light.
        """
        rows, columns = np.flatnonzero(surface.any(axis=1)), np.flatnonzero(surface.any(axis=0))
        self._window = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        self._surface = np.where(surface, 255, 0).astype(np.uint8)[self._window]
        self._size = camera.width, camera.height
        self._height = height
        self._fall = light[:2] / light[2]
        pose = camera.pose()
        intrinsics = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
        # Points (x, y, height) of the surface to coarse pixels, homogeneous.
        rotation = pose[:3, :3].T
        origin = rotation @ (np.array([0.0, 0.0, height]) - pose[:3, 3])
        view = np.column_stack([rotation[:, 0], rotation[:, 1], origin])
        self._to_image = np.diag([1 / COARSE, 1 / COARSE, 1.0]) @ intrinsics @ view
        self._outline = lru_cache(KEPT)(self._outline_at)

    def cast(
        self, rgb: NDArray[np.uint8], bodies: Sequence[tuple[ConvexMesh, NDArray[np.float64]]]
    ) -> None:
        """Draw the bodies' shadows into the background `rgb` (H, W, 3), in place."""
        tone = self._tone(bodies)
        if tone is None:
            return
        area = rgb[self._window]
        shade = cv2.resize(tone, self._size, interpolation=cv2.INTER_LINEAR)[self._window]
        light = cv2.bitwise_not(cv2.bitwise_and(shade, self._surface))
        area[:] = cv2.multiply(area, cv2.merge([light, light, light]), scale=1 / 255)

    def _tone(
        self, bodies: Sequence[tuple[ConvexMesh, NDArray[np.float64]]]
    ) -> NDArray[np.uint8] | None:
        """How much light is missing, coarse (H / 4, W / 4), 0 to 255; None if none is."""
        width, height = self._size
        crisp = np.zeros((height // COARSE, width // COARSE), np.uint8)
        wide = np.zeros_like(crisp)
        cast = [self._outline(mesh, pose.tobytes()) for mesh, pose in bodies]
        # The highest first: what is drawn later is nearer the surface and darker.
        for clearance, outline in sorted((c for c in cast if c is not None), key=lambda c: -c[0]):
            tone = DARKEST * np.exp(-clearance / FADING)
            target = crisp if clearance < CONTACT else wide
            cv2.fillConvexPoly(target, outline, tone, cv2.LINE_8, 4)
        if not crisp.any() and not wide.any():
            return None
        soft = cv2.blur(cv2.blur(wide, (WIDE, WIDE)), (WIDE, WIDE))
        return np.asarray(cv2.max(cv2.GaussianBlur(crisp, (0, 0), CRISP), soft))

    def _outline_at(
        self, mesh: ConvexMesh, matrix: bytes
    ) -> tuple[float, NDArray[np.int32]] | None:
        """A part's clearance, m, and its shadow's outline, 1/16 coarse px; None if below.

        matrix: the pose, 4x4.
        """
        pose = np.frombuffer(matrix).reshape(4, 4)
        points = mesh.vertices @ pose[:3, :3].T + pose[:3, 3]
        above = points[:, 2] - self._height
        if above.max() <= 0.0:
            return None
        ground = points[:, :2] - np.maximum(above, 0.0)[:, None] * self._fall
        image = ground @ self._to_image[:, :2].T + self._to_image[:, 2]
        if image[:, 2].min() <= 0.0:
            return None
        pixels = np.rint(16 * image[:, :2] / image[:, 2:]).astype(np.int32)
        return max(float(above.min()), 0.0), cv2.convexHull(pixels)
