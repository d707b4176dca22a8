"""The simulated cell as a frozen description: what stands where, in metres, in base_link.

base_link: x forward (towards the person), y left, z up; z = 0 is the table top and the robot's
mounting plane. The layout follows Fig 2a of Chung et al. 2015: robot on one side of the work area,
person on the other, a blue line between LEFT and RIGHT, a Kinect on the robot's frame looking
down.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class State(IntEnum):
    """Where an object is; the numbers of likeme_msgs/ObjectState and of the authors' data."""

    LEFT = 0
    RIGHT = 1
    OFFTABLE = 2


class Action(IntEnum):
    """The six actions; the numbers of likeme_msgs/ExecuteAction and of the authors' data."""

    PLACE_LEFT = 0
    PLACE_RIGHT = 1
    PLACE_OFFTABLE = 2
    PUSH_LEFT = 3
    PUSH_RIGHT = 4
    PUSH_OFFTABLE = 5

    @property
    def is_push(self) -> bool:
        """Whether the object is pushed rather than grasped and placed."""
        return self >= Action.PUSH_LEFT

    @property
    def target(self) -> State:
        """The state the action aims at."""
        return State(self % 3)


@dataclass(frozen=True)
class Rectangle:
    """An axis-aligned area of the table plane, m."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float

    def contains(self, x: float, y: float) -> bool:
        """Whether a point lies inside, edges included."""
        return self.x_min <= x <= self.x_max and self.y_min <= y <= self.y_max

    @property
    def centre(self) -> tuple[float, float]:
        """The middle, (x, y)."""
        return (self.x_min + self.x_max) / 2, (self.y_min + self.y_max) / 2


@dataclass(frozen=True)
class Table:
    """A slab whose top is z = 0. The work area is the part of it that counts as LEFT or RIGHT."""

    top: Rectangle = Rectangle(0.22, 0.66, -0.38, 0.38)
    work_area: Rectangle = Rectangle(0.27, 0.61, -0.33, 0.33)
    blue_line_y: float = 0.0
    blue_line_width: float = 0.012
    thickness: float = 0.03
    floor_z: float = -0.20

    def state_of(self, x: float, y: float, z: float = 0.0) -> State:
        """State of an object whose centroid is (x, y, z): the paper's centroid rule."""
        if z < -self.thickness or not self.work_area.contains(x, y):
            return State.OFFTABLE
        return State.LEFT if y > self.blue_line_y else State.RIGHT


@dataclass(frozen=True)
class CameraMount:
    """A pinhole camera: where it hangs, where it looks, and its intrinsics (pixels).

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


# What ROS calls the camera's optical frame.
CAMERA_FRAME = 'camera_rgb_optical_frame'
OBJECTS: tuple[str, ...] = ('pear', 'lemon', 'chicken')


@dataclass(frozen=True)
class Scene:
    """Everything that stands still."""

    table: Table = Table()
    camera: CameraMount = CameraMount()
    objects: tuple[str, ...] = OBJECTS
