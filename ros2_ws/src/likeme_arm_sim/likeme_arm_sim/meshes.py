"""Convex triangle meshes, for collisions and for drawing.

Every body of the cell is a set of convex parts. A convex part is a bullet hull, and after
back-face culling it covers each pixel at most once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

Floats = NDArray[np.float64]
Colour = tuple[int, int, int]

# Neighbouring faces closer than this in direction are shaded as one smooth surface.
SMOOTH_WITHIN = np.radians(40.0)


@dataclass(frozen=True, eq=False)
class ConvexMesh:
    """A convex polyhedron in its own frame.

    Attributes:
        vertices: (V, 3), m.
        triangles: (T, 3) int32 indices into `vertices`, counter-clockwise seen from outside.
        colours: (T, 3) uint8 RGB, one colour per triangle.
    """

    vertices: Floats
    triangles: NDArray[np.int32]
    colours: NDArray[np.uint8]

    @cached_property
    def corners(self) -> Floats:
        """Corner points of every triangle, (T, 3 corners, xyz), m."""
        return np.asarray(self.vertices[self.triangles])

    @cached_property
    def areas(self) -> Floats:
        """(T,) m^2."""
        return np.asarray(np.linalg.norm(_cross_of_edges(self.corners), axis=1) / 2)

    @cached_property
    def normals(self) -> Floats:
        """Outward unit normals, (T, 3)."""
        cross = _cross_of_edges(self.corners)
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        return np.asarray(cross / np.maximum(length, 1e-30))

    @cached_property
    def offsets(self) -> Floats:
        """Each face's distance from the origin along its normal, (T,), m: n x = offset."""
        return np.asarray(np.einsum('ti,ti->t', self.normals, self.corners[:, 0]))

    @cached_property
    def corner_normals(self) -> Floats:
        """Shading normals, (T, 3 corners, xyz): means over faces that meet there smoothly."""
        touches = np.zeros((len(self.triangles), len(self.vertices)), bool)
        touches[np.arange(len(self.triangles))[:, None], self.triangles] = True
        smooth = self.normals @ self.normals.T > np.cos(SMOOTH_WITHIN)
        meets = smooth[:, None, :] & touches.T[self.triangles]
        total = meets @ (self.normals * self.areas[:, None])
        return np.asarray(total / np.maximum(np.linalg.norm(total, axis=2, keepdims=True), 1e-30))

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether each of the points (N, 3) lies inside, surface included."""
        heights = np.asarray(points) @ self.normals.T - self.offsets
        return np.asarray(np.all(heights < 1e-9, axis=1))

    def transformed(self, pose: ArrayLike) -> ConvexMesh:
        """The same mesh in another frame, by a rigid 4x4 pose."""
        matrix = np.asarray(pose, float)
        return replace(self, vertices=self.vertices @ matrix[:3, :3].T + matrix[:3, 3])

    def moved(self, offset: ArrayLike) -> ConvexMesh:
        """The same mesh shifted by `offset` (3,), m."""
        return replace(self, vertices=self.vertices + np.asarray(offset, float))

    def painted(self, paint: Callable[[Floats], NDArray[np.uint8]]) -> ConvexMesh:
        """The same mesh with each triangle coloured by `paint(centres (T, 3)) -> (T, 3) RGB`."""
        return replace(self, colours=paint(self.corners.mean(axis=1)))


def _cross_of_edges(corners: Floats) -> Floats:
    """Twice the area times the normal, (T, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def convex_hull(points: ArrayLike, colour: Colour) -> ConvexMesh:
    """The hull of points (N, 3), m, in one colour; interior points are dropped."""
    cloud = np.asarray(points, float)
    hull = ConvexHull(cloud)
    kept = hull.vertices
    index = np.full(len(cloud), -1, np.int32)
    index[kept] = np.arange(len(kept), dtype=np.int32)
    triangles, vertices = index[hull.simplices], cloud[kept]
    # Qhull's winding is arbitrary; its plane equations point outwards.
    inward = np.einsum('ti,ti->t', _cross_of_edges(vertices[triangles]), hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return ConvexMesh(vertices, triangles, _uniform(colour, len(triangles)))


def _uniform(colour: Colour, count: int) -> NDArray[np.uint8]:
    return np.tile(np.asarray(colour, np.uint8), (count, 1))


def lathe(stations: Iterable[tuple[float, float]], colour: Colour, sides: int = 28) -> ConvexMesh:
    """The hull of circles about the x axis, given as (x, radius), m.

    Neighbouring circles are turned by half a step, so that the body rolls on points rather than
    from one flat facet to the next.
    """
    rings = []
    for k, (x, radius) in enumerate(stations):
        angle = 2 * np.pi * (np.arange(sides) + 0.5 * (k % 2)) / sides
        ring = [np.full(sides, x), radius * np.cos(angle), radius * np.sin(angle)]
        rings.append(np.stack(ring, axis=1) if radius > 1e-9 else np.array([[x, 0.0, 0.0]]))
    return convex_hull(np.concatenate(rings), colour)


def ellipsoid(
    semi_axes: tuple[float, float, float], colour: Colour, sides: int = 20, rings: int = 10
) -> ConvexMesh:
    """An ellipsoid about the origin with the given semi-axes along x, y, z, m."""
    theta = np.linspace(0.0, np.pi, rings + 1)
    unit = lathe(zip(-np.cos(theta), np.sin(theta), strict=True), colour, sides)
    return replace(unit, vertices=unit.vertices * np.asarray(semi_axes))


def capsule(
    start: ArrayLike,
    end: ArrayLike,
    radius: float,
    colour: Colour,
    end_radius: float | None = None,
    sides: int = 12,
) -> ConvexMesh:
    """The hull of two spheres, about `start` and `end` (3,), m: a finger or a tapered limb."""
    far = radius if end_radius is None else end_radius
    ball = ellipsoid((1.0, 1.0, 1.0), colour, sides, max(sides // 2, 4)).vertices
    turned = ball @ _frame_along(np.asarray(end, float) - np.asarray(start, float)).T
    points = [np.asarray(start) + radius * turned, np.asarray(end) + far * turned]
    return convex_hull(np.concatenate(points), colour)


def _frame_along(axis: Floats) -> Floats:
    """A rotation (3, 3) whose first column is the direction of `axis`."""
    x = axis / max(float(np.linalg.norm(axis)), 1e-12)
    helper = np.eye(3)[int(np.argmin(np.abs(x)))]
    y = np.cross(helper, x)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def box(size: ArrayLike, colour: Colour, centre: ArrayLike = (0.0, 0.0, 0.0)) -> ConvexMesh:
    """An axis-aligned box of the given edge lengths (3,), m."""
    signs = np.array(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5])).reshape(3, 8).T
    return convex_hull(signs * np.asarray(size, float) + np.asarray(centre, float), colour)


def hull_from_obj(path: Path, colour: Colour) -> ConvexMesh:
    """The convex hull of the vertices of a Wavefront OBJ file, as bullet makes it from one."""
    rows = [line.split()[1:4] for line in path.read_text().splitlines() if line.startswith('v ')]
    if len(rows) < 4:
        raise ValueError(f'Expected at least 4 vertices in {path.name}, got {len(rows)}.')
    return convex_hull(np.asarray(rows, float), colour)
