"""Open3D's way from a depth image to objects: the table's plane, and clusters of what is left."""

from __future__ import annotations

import ctypes
from typing import Any

import libusb_package
import numpy as np

from likeme_perception.rgbd import Intrinsics

# Open3D's wheel links to a libusb of the system's; by its name it finds one that is loaded.
ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
import open3d as o3d  # noqa: E402

#: m: edge of a voxel; distance of a point that counts as the plane's; of neighbours in a cluster.
VOXEL, PLANE, NEIGHBOURS = 0.005, 0.01, 0.02
#: Samples of the plane, points of a cluster's core.
SAMPLES, CORE = 100, 10


class Clustering:
    """Finds objects in single frames.

    Attributes:
        clusters: of the last frame.
    """

    def __init__(self, lens: Intrinsics) -> None:
        self._lens = o3d.camera.PinholeCameraIntrinsic(
            lens.width, lens.height, lens.fx, lens.fy, lens.cx, lens.cy
        )
        self.clusters = 0

    def look(self, depth: Any) -> None:
        """Take in depth, float32 array of m, shape [row, column]."""
        image = o3d.geometry.Image(depth)
        cloud = o3d.geometry.PointCloud.create_from_depth_image(
            image, self._lens, depth_scale=1.0, depth_trunc=2.0
        )
        cloud = cloud.voxel_down_sample(VOXEL)
        _, on_plane = cloud.segment_plane(PLANE, 3, SAMPLES)
        rest = cloud.select_by_index(on_plane, invert=True)
        labels = rest.cluster_dbscan(NEIGHBOURS, CORE)
        self.clusters = int(np.asarray(labels).max(initial=-1)) + 1
