"""Where the camera is and what it sees: pose, intrinsics and frame rate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

#: Frame id of the images.
CAMERA_FRAME = 'camera_rgb_optical_frame'


@dataclass(frozen=True)
class CameraMount:
    """A pinhole camera: position and target (m, base_link), intrinsics (pixels), frames a second.

    The optical frame follows ROS: z forward, x right, y down. With a roll (rad) of 0 the image's
    right is the robot's right as nearly as the viewing direction allows; a positive one turns the
    camera clockwise, seen along its view. The default intrinsics are those commonly used for the
    first Kinect (525 px at 640x480).
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
    roll: float = 0.0

    def pose(self) -> NDArray[np.float64]:
        """4x4 transform from the optical frame to base_link; up in the image is away from it."""
        eye = np.asarray(self.position)
        forward = np.asarray(self.target) - eye
        forward /= np.linalg.norm(forward)
        # The image's right is the robot's right (-y) as nearly as the viewing direction allows.
        right = np.array([0.0, -1.0, 0.0])
        right -= right.dot(forward) * forward
        right /= np.linalg.norm(right)
        down = np.cross(forward, right)
        cosine, sine = np.cos(self.roll), np.sin(self.roll)
        pose = np.eye(4)
        pose[:3, 0] = cosine * right + sine * down
        pose[:3, 1] = cosine * down - sine * right
        pose[:3, 2], pose[:3, 3] = forward, eye
        return pose


def camera_at(pose: NDArray[np.float64], intrinsics: CameraMount) -> CameraMount:
    """The camera with a pose (4x4, optical frame to base_link), as a world file says it.

    Its target is where the optical axis meets the table top; 1 m ahead if it does not. intrinsics:
    whose values but position, target and roll are taken.

    Raises:
        ValueError: the camera looks along y, where no roll is defined.
    """
    eye, forward = pose[:3, 3], pose[:3, 2]
    if abs(forward[1]) > 0.999:
        raise ValueError(f'Expected a camera that does not look along y, got {forward.round(3)}.')
    ahead = -eye[2] / forward[2] if forward[2] < -0.1 else 1.0
    unrolled = replace(
        intrinsics, position=_triple(eye), target=_triple(eye + ahead * forward), roll=0.0
    )
    level = unrolled.pose()[:3, :3].T @ pose[:3, 0]
    return replace(unrolled, roll=float(np.arctan2(level[1], level[0])))


def _triple(point: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = point
    return float(x), float(y), float(z)
