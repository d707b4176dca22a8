"""The pose of the grasp point with the hand pointing straight down."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


class NoSolutionError(Exception):
    """Inverse kinematics found no joint angles for a pose."""


class ToolPose(NamedTuple):
    """The grasp point with the hand pointing straight down.

    x, y, z: m, base_link. yaw: direction of the hand's flat axis, rad about +z; the fingers close
    across it.
    """

    x: float
    y: float
    z: float
    yaw: float

    @property
    def position(self) -> Vector:
        """(x, y, z), m."""
        return np.array([self.x, self.y, self.z])

    def lifted_to(self, z: float) -> ToolPose:
        """The same pose at another height."""
        return self._replace(z=z)


def wrap_half_turn(angle: float) -> float:
    """The angle of an undirected axis, in (-pi/2, pi/2]."""
    wrapped = (angle + np.pi / 2) % np.pi - np.pi / 2
    return float(np.pi / 2 if np.isclose(wrapped, -np.pi / 2) else wrapped)
