"""Detection of the table: camera pose relative to its plane, and the pixels that show it."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.geometry import Rectangle
from likeme_perception.camera_view import CameraView, levelled, pose_from_plane
from likeme_perception.config import PerceptionConfig
from likeme_perception.errors import NoTableError
from likeme_perception.plane import Plane, ransac_plane, refine_plane
from likeme_perception.rgbd import Intrinsics, deproject

ImageF = NDArray[np.float32]
Mask = NDArray[np.bool_]


def find_table(depth: ImageF, config: PerceptionConfig, intrinsics: Intrinsics) -> CameraView:
    """The camera with its pose: the configured one, levelled to the plane, or estimated."""
    rng = np.random.default_rng(0)
    cloud = deproject(depth, intrinsics)[::4, ::4]
    pose = config.camera_pose()
    if pose is None:
        return CameraView(intrinsics, pose_from_plane(_table_plane(cloud, rng)))
    points = cloud[np.isfinite(cloud[:, :, 2])].astype(np.float64)
    in_base = points @ pose[:3, :3].T + pose[:3, 3]
    near = np.abs(in_base[:, 2]) < 0.05
    if config.table is not None:
        near &= config.table.contains(in_base[:, 0], in_base[:, 1], -0.01)
    if near.sum() < 200:
        raise NoTableError(
            f'Expected the table at z = 0 in {config.reference_frame}, '
            f'got {int(near.sum())} points there: is the camera pose right?'
        )
    plane = ransac_plane(points[near], rng)
    return CameraView(intrinsics, levelled(pose, refine_plane(points[near], plane, 0.01)))


def _table_plane(cloud: ImageF, rng: np.random.Generator) -> Plane:
    """The largest plane, unless it covers little of the image's middle: then the largest there.

    The camera is aimed at the table; a larger plane at the image's border may be the floor.
    """
    rows, columns = cloud.shape[0] // 4, cloud.shape[1] // 4
    middle = cloud[rows:-rows, columns:-columns].reshape(-1, 3)
    middle = middle[np.isfinite(middle[:, 2])]
    largest, central = ransac_plane(cloud.reshape(-1, 3), rng), ransac_plane(middle, rng)
    share, best = (np.mean(np.abs(p.height(middle)) < 0.01) for p in (largest, central))
    return central if best > 3 * share else largest


def table_pixels(
    depth: ImageF, view: CameraView, config: PerceptionConfig
) -> tuple[Mask, Rectangle]:
    """Mask of the pixels whose ray meets the table, and the table's rectangle."""
    x, y = view.ground[:, :, 0], view.ground[:, :, 1]
    if config.table is not None:
        return config.table.contains(x, y), config.table
    with np.errstate(invalid='ignore'):
        flat = np.abs(depth / view.depth_at_height(0.0) - 1) < 0.02
    _, labels, stats, _ = cv2.connectedComponentsWithStats(flat.astype(np.uint8))
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    outline = np.argwhere(labels == largest)[:, ::-1].astype(np.int32)
    hull = np.zeros(depth.shape, np.uint8)
    cv2.fillConvexPoly(hull, cv2.convexHull(outline), (1,))
    inside = hull.astype(bool)
    corner = [np.percentile(v[inside], q) for v in (x, y) for q in (0.5, 99.5)]
    return inside, Rectangle(*(float(v) for v in corner))
