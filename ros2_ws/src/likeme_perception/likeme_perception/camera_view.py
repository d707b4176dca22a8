"""Camera with a known pose: deprojection into the reference frame, and projection."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from likeme_perception.errors import NoTableError
from likeme_perception.plane import Plane
from likeme_perception.rgbd import Intrinsics, rays

ImageF = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class CameraView:
    """A pinhole camera and its pose.

    pose: 4x4 transform from the optical to the reference frame, whose z = 0 is the table top.
    """

    intrinsics: Intrinsics
    pose: NDArray[np.float64]

    @cached_property
    def directions(self) -> ImageF:
        """Viewing rays in the reference frame, scaled to unit depth, (H*W, 3)."""
        turned = rays(self.intrinsics).reshape(-1, 3) @ self.pose[:3, :3].T.astype(np.float32)
        return np.ascontiguousarray(turned, np.float32)

    @property
    def slope(self) -> ImageF:
        """Change of height per m of depth along each ray, (H, W); negative looking down."""
        return self.directions[:, 2].reshape(self.intrinsics.shape)

    @property
    def origin(self) -> ImageF:
        """The camera's position, m."""
        return self.pose[:3, 3].astype(np.float32)

    def points(self, pixels: NDArray[np.intp], depth: ImageF) -> ImageF:
        """Points (N, 3) of flat pixel indices (N,) with their depths (N,), m."""
        points = self.directions.take(pixels, axis=0)
        # Axis by axis: broadcasting over rows of three values is many times slower.
        for axis, offset in enumerate(self.origin):
            points[:, axis] *= depth
            points[:, axis] += offset
        return points

    def depth_at_height(self, height: float | ImageF) -> ImageF:
        """Depth at which each ray has this height above the table, (H, W); inf if never."""
        slope = self.slope
        with np.errstate(divide='ignore', invalid='ignore'):
            depth = (np.float32(height) - self.origin[2]) / slope
        return np.where(depth > 0, depth, np.inf).astype(np.float32)

    @cached_property
    def ground(self) -> ImageF:
        """Intersection (x, y) of each ray with the table plane, m, (H, W, 2); NaN without."""
        depth = self.depth_at_height(0.0).reshape(-1, 1)
        depth = np.where(np.isfinite(depth), depth, np.nan)
        xy = self.directions[:, :2] * depth + self.origin[:2]
        return np.asarray(xy.reshape(*self.intrinsics.shape, 2), np.float32)

    def pixel_area(self, depth: ImageF) -> ImageF:
        """Area that one pixel covers at a depth, perpendicular to the optical axis, m^2."""
        return np.asarray(depth**2 / (self.intrinsics.fx * self.intrinsics.fy), np.float32)

    def project(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Pixel coordinates (u, v) of points (N, 3) in the reference frame, (N, 2)."""
        local = (np.asarray(points, float) - self.pose[:3, 3]) @ self.pose[:3, :3]
        z = np.maximum(local[:, 2], 1e-6)
        k = self.intrinsics
        return np.stack([k.fx * local[:, 0] / z + k.cx, k.fy * local[:, 1] / z + k.cy], axis=1)


def levelled(pose: NDArray[np.float64], plane: Plane) -> NDArray[np.float64]:
    """The pose corrected by the smallest rotation and lift that make the table plane z = 0.

    plane: as measured in the optical frame.
    """
    normal = pose[:3, :3] @ np.asarray(plane.normal)
    axis = np.cross(normal, [0.0, 0.0, 1.0])
    sine, cosine = float(np.linalg.norm(axis)), float(normal[2])
    turn = np.eye(3)
    if sine > 1e-12:
        k = axis / sine
        skew = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
        turn = np.eye(3) + sine * skew + (1 - cosine) * skew @ skew
    level = pose.copy()
    level[:3, :3] = turn @ pose[:3, :3]
    level[2, 3] = plane.offset
    return level


def pose_from_plane(plane: Plane) -> NDArray[np.float64]:
    """Camera pose from the table plane: origin on the optical axis, x towards the image's top."""
    z = np.asarray(plane.normal)
    x = -np.array([0.0, 1.0, 0.0]) + z[1] * z
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    if abs(z[2]) < 1e-3:
        raise NoTableError(
            f'Expected a camera that looks at the table, got a view {z[2]:.4f} along it.'
        )
    foot = np.array([0.0, 0.0, -plane.offset / z[2]])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, -rotation @ foot
    return pose
