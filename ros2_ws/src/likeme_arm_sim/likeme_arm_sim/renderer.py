"""A z-buffer camera for convex meshes: colour and exact depth in a few milliseconds of NumPy.

pybullet's own software renderer loads and draws heavy visual meshes and reaches a few frames per
second at 640x480. Here the static scene is drawn once, and per frame only the front triangles of
the bodies that may move are rasterised (see raster.py).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from likeme_arm_sim.meshes import ConvexMesh, Floats
from likeme_arm_sim.raster import Fragments, clip_near, fragments, project
from likeme_arm_sim.shadows import SoftShadows
from likeme_core.camera_mount import CameraMount

# A soft light above the table, a little towards the robot's left and the camera.
LIGHT = np.array([-0.30, 0.35, 0.89]) / np.linalg.norm([-0.30, 0.35, 0.89])
# Their sum is at most 1, so that no colour overflows.
AMBIENT, DIFFUSE = 0.45, 0.55
# The static background is drawn this much finer and averaged: smooth edges at no cost per frame.
SUPERSAMPLING = 2
# Number of pictures of returning bodies that are kept, and of their poses that are remembered: a
# picture is made at the second time.
PICTURES, POSES = 8, 64


class RenderBody(NamedTuple):
    """A mesh and its pose, the 4x4 transform from the mesh's frame to base_link."""

    mesh: ConvexMesh
    pose: NDArray[np.float64]


@dataclass(frozen=True)
class PaintedPlane:
    """A static mesh in base_link whose colour is a function of position.

    Attributes:
        mesh: vertices in base_link.
        paint: points (N, 3), m, to RGB (N, 3).
        shadows_at: height, m, at which the mesh's top shows the moving bodies' shadows, if any.
    """

    mesh: ConvexMesh
    paint: Callable[[Floats], NDArray[np.uint8]]
    shadows_at: float | None = None


class Rendering(NamedTuple):
    """One ideal frame.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth: (H, W) float32, m along the optical axis, inf where nothing is.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]


#: Bodies by mesh and pose, 4x4, as bytes.
_Placed = tuple[tuple[ConvexMesh, bytes], ...]


class _Picture(NamedTuple):
    """Bodies alone: the image's rows that show them, their colour, and inverse depth or -1."""

    rows: slice
    rgb: NDArray[np.uint8]
    inverse: NDArray[np.float32]


class CameraProjection:
    """Projection by a camera at a fixed pose."""

    def __init__(self, camera: CameraMount) -> None:
        self.camera = camera
        pose = camera.pose()
        self.eye: Floats = pose[:3, 3]
        self._rotation: Floats = pose[:3, :3].T

    def front_faces(self, body: RenderBody) -> tuple[Floats, NDArray[np.uint8]]:
        """A body's front triangles: corners (T, 3, 4) and colours (T, 3).

        A corner is a point in the optical frame, m, and its brightness.
        """
        mesh, rotation, offset = body.mesh, body.pose[:3, :3], body.pose[:3, 3]
        eye = (self.eye - offset) @ rotation
        front = np.flatnonzero(mesh.normals @ eye > mesh.offsets)
        seen = (mesh.vertices - eye) @ (self._rotation @ rotation).T
        corners = np.empty((len(front), 3, 4))
        corners[:, :, :3] = seen[mesh.triangles[front]]
        to_light = (mesh.corner_normals.reshape(-1, 3) @ (LIGHT @ rotation)).reshape(-1, 3)[front]
        # Half-Lambert: faces turned away from the light still show shape.
        corners[:, :, 3] = AMBIENT + DIFFUSE * np.square(0.5 * to_light + 0.5)
        return corners, mesh.colours[front]

    def fragments(self, corners: Floats) -> tuple[Fragments, NDArray[np.intp]]:
        """Pixels of triangles (T, 3, 4) in the optical frame, and the triangle of each pixel."""
        clipped, origin = clip_near(corners)
        image = project(clipped, self.camera)
        found = fragments(image, self.camera.width, self.camera.height)
        return found, origin[found.triangle]

    def points(self, pixel: NDArray[np.intp], inverse_depth: NDArray[np.float32]) -> Floats:
        """Surface points of the pixels in base_link, (N, 3), m."""
        v, u = np.divmod(pixel, self.camera.width)
        x, y = (u - self.camera.cx) / self.camera.fx, (v - self.camera.cy) / self.camera.fy
        rays = np.stack([x, y, np.ones_like(x)], axis=1) / inverse_depth[:, None]
        return np.asarray(rays @ self._rotation + self.eye)


class MeshRenderer:
    """Draws moving convex bodies in front of a static background."""

    def __init__(
        self,
        camera: CameraMount,
        background: Sequence[RenderBody | PaintedPlane] = (),
        returning: Collection[ConvexMesh] = (),
    ) -> None:
        """returning: meshes that often return to the same pose; their pictures there are kept."""
        self._returning = frozenset(returning)
        self._view = CameraProjection(camera)
        _, self._static_inverse, surface = _draw_static(CameraProjection(camera), background)
        heights = [item.shadows_at for item in background if isinstance(item, PaintedPlane)]
        self._shadows = [
            SoftShadows(camera, LIGHT, height, surface)
            for height in heights
            if height is not None and surface.any()
        ]
        fine, _, _ = _draw_static(CameraProjection(_finer(camera, SUPERSAMPLING)), background)
        size = (camera.width, camera.height)
        self._static_rgb = np.asarray(
            cv2.resize(fine, size, interpolation=cv2.INTER_AREA), np.uint8
        )
        self._picture = lru_cache(PICTURES)(self._drawn_alone)
        self._met: dict[_Placed, None] = {}

    def render(self, bodies: Sequence[RenderBody]) -> Rendering:
        """The frame with `bodies` in front of the background."""
        rgb, inverse = self._static_rgb.copy(), self._static_inverse.copy()
        for shadows in self._shadows:
            shadows.cast(rgb, bodies)
        for returns, group in groupby(bodies, lambda body: body.mesh in self._returning):
            some = list(group)
            placed = tuple((body.mesh, body.pose.tobytes()) for body in some)
            if returns and self._has_met(placed):
                _put(self._picture(placed), rgb, inverse)
            else:
                self._draw(some, rgb, inverse)
        with np.errstate(divide='ignore'):
            return Rendering(rgb, np.divide(np.float32(1.0), inverse, out=inverse))

    def _draw(
        self, bodies: Sequence[RenderBody], rgb: NDArray[np.uint8], inverse: NDArray[np.float32]
    ) -> None:
        """Draw bodies into an image of colour and inverse depth, in place."""
        parts = [self._view.front_faces(body) for body in bodies]
        corners = np.concatenate([corners for corners, _ in parts])
        colours = np.concatenate([colours for _, colours in parts]).astype(np.float32)
        found, triangle = self._view.fragments(corners)
        nearest = _nearest(found, inverse)
        pixel, triangle, shade = found.pixel[nearest], triangle[nearest], found.shade[nearest]
        # One channel at a time is three times as fast as rows of three bytes.
        for channel in range(3):
            rgb.reshape(-1, 3)[pixel, channel] = colours[:, channel][triangle] * shade

    def _has_met(self, placed: _Placed) -> bool:
        """Whether bodies were drawn there lately; from now on they were."""
        met = placed in self._met
        self._met[placed] = None
        if len(self._met) > POSES:
            del self._met[next(iter(self._met))]
        return met

    def _drawn_alone(self, placed: _Placed) -> _Picture:
        """Bodies in front of nothing."""
        rgb, inverse = np.zeros_like(self._static_rgb), np.full_like(self._static_inverse, -1)
        bodies = [RenderBody(mesh, np.frombuffer(pose).reshape(4, 4)) for mesh, pose in placed]
        self._draw(bodies, rgb, inverse)
        shown = np.flatnonzero((inverse > 0).any(axis=1))
        rows = slice(shown[0], shown[-1] + 1) if len(shown) else slice(0, 0)
        return _Picture(rows, rgb[rows].copy(), inverse[rows].copy())


def _put(picture: _Picture, rgb: NDArray[np.uint8], inverse: NDArray[np.float32]) -> None:
    """Draw kept bodies into an image of colour and inverse depth, in place."""
    rows = picture.rows
    if len(picture.rgb) == 0:
        return
    nearest = picture.inverse >= inverse[rows]
    cv2.copyTo(picture.rgb, nearest.view(np.uint8), rgb[rows])
    np.maximum(inverse[rows], picture.inverse, out=inverse[rows])


def _nearest(found: Fragments, inverse_depth: NDArray[np.float32]) -> NDArray[np.intp]:
    """Merge fragments into `inverse_depth` (H, W), in place; indices of those that are seen."""
    flat = inverse_depth.reshape(-1)
    np.maximum.at(flat, found.pixel, found.inverse_depth)
    return np.flatnonzero(flat[found.pixel] == found.inverse_depth)


def _finer(camera: CameraMount, factor: int) -> CameraMount:
    """The same camera with `factor` times the pixels along each side."""
    return replace(
        camera,
        width=camera.width * factor,
        height=camera.height * factor,
        fx=camera.fx * factor,
        fy=camera.fy * factor,
        cx=(camera.cx + 0.5) * factor - 0.5,
        cy=(camera.cy + 0.5) * factor - 0.5,
    )


def _draw_static(
    view: CameraProjection, background: Sequence[RenderBody | PaintedPlane]
) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.bool_]]:
    """The static scene: colour (H, W, 3), inverse depth (H, W) and where shadows can fall."""
    shape = (view.camera.height, view.camera.width)
    rgb, inverse = np.full((*shape, 3), 40, np.uint8), np.zeros(shape, np.float32)
    surface = np.zeros(shape, bool)
    for item in background:
        pose = item.pose if isinstance(item, RenderBody) else np.eye(4)
        corners, colours = view.front_faces(RenderBody(item.mesh, pose))
        found, triangle = view.fragments(corners)
        seen = _nearest(found, inverse)
        pixel = found.pixel[seen]
        base: ArrayLike = colours[triangle[seen]]
        surface.reshape(-1)[pixel] = False
        if isinstance(item, PaintedPlane):
            points = view.points(pixel, found.inverse_depth[seen])
            base = item.paint(points)
            if item.shadows_at is not None:
                surface.reshape(-1)[pixel] = points[:, 2] > item.shadows_at - 1e-4
        shaded = np.asarray(base) * found.shade[seen, None]
        rgb.reshape(-1, 3)[pixel] = shaded.astype(np.uint8)
    return rgb, inverse, surface
