"""Where the camera is and what it sees: pose, intrinsics and frame rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Frame id of the images.
CAMERA_FRAME = 'camera_rgb_optical_frame'


@dataclass(frozen=True)
class CameraMount:
    """A pinhole camera: position and target (m, base_link), intrinsics (pixels), frames a second.

    The optical frame follows ROS: z forward, x right, y down. The default intrinsics are those
    commonly used for the first Kinect (525 px at 640x480).
    """

    position: tuple[float, float, float]
    target: tuple[float, float, float]
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
