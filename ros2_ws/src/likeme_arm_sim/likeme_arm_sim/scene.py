"""Layout of the simulated cell: positions in base_link, m.

base_link: x forward (towards the person), y left, z up; z = 0 is the table top and the robot's
mounting plane. The layout follows Fig 2a of Chung et al. 2015: robot on one side of the work area,
person on the other, a blue line between LEFT and RIGHT, a Kinect on the robot's frame looking
down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from likeme_core.table import Table


@dataclass(frozen=True)
class CameraMount:
    """A pinhole camera: position, target and intrinsics (pixels).

    The optical frame follows ROS: z forward, x right, y down. Intrinsics are those commonly used
    for the first Kinect (525 px at 640x480).
    """

    position: tuple[float, float, float] = (0.05, 0.38, 0.90)
    target: tuple[float, float, float] = (0.44, -0.02, 0.0)
    width: int = 640
    height: int = 480
    fx: float = 525.0
    fy: float = 525.0
    cx: float = 319.5
    cy: float = 239.5
    rate: float = 30.0

    def pose(self) -> NDArray[np.float64]:
        """4x4 transform from the optical frame to base_link; up in the image is away from it."""
        eye = np.asarray(self.position)
        forward = np.asarray(self.target) - eye
        forward /= np.linalg.norm(forward)
        # The image's right is the robot's right (-y) as nearly as the viewing direction allows.
        right = np.array([0.0, -1.0, 0.0])
        right -= right.dot(forward) * forward
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = (
            right,
            np.cross(forward, right),
            forward,
            eye,
        )
        return pose


# Frame id of the images.
CAMERA_FRAME = 'camera_rgb_optical_frame'
OBJECTS: tuple[str, ...] = ('pear', 'lemon', 'chicken')


@dataclass(frozen=True)
class Scene:
    """Table, camera and the names of the objects."""

    table: Table = Table()
    camera: CameraMount = CameraMount()
    objects: tuple[str, ...] = OBJECTS
