"""Frames of agent and mentor in the plane: SE(2) transforms of points and of Gaussian beliefs.

Positions in cm, headings in rad, counter-clockwise from x (REP-103: x forward, y left).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from likeme_gaze.beliefs import Gaussian
from likeme_gaze.checks import FloatArray


class Pose2(NamedTuple):
    """Where a frame's origin is in its parent's frame, and where its x axis points."""

    x: float
    y: float
    heading: float

    @property
    def rotation(self) -> FloatArray:
        """Turns vectors of this frame into vectors of the parent's (2, 2)."""
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        return np.array([[cosine, -sine], [sine, cosine]])

    def to_parent(self, points: ArrayLike) -> FloatArray:
        """Points (..., 2) of this frame, in the parent's."""
        return np.asarray(np.asarray(points) @ self.rotation.T + (self.x, self.y))

    def from_parent(self, points: ArrayLike) -> FloatArray:
        """Points (..., 2) of the parent's frame, in this one."""
        return np.asarray((np.asarray(points) - (self.x, self.y)) @ self.rotation)

    def belief_to_parent(self, belief: Gaussian) -> Gaussian:
        """A Gaussian over places in this frame, in the parent's: R m + t and R S R'."""
        turn = self.rotation
        return Gaussian(self.to_parent(belief.mean), turn @ belief.covariance @ turn.T)

    def belief_from_parent(self, belief: Gaussian) -> Gaussian:
        """A Gaussian over places in the parent's frame, in this one."""
        turn = self.rotation
        return Gaussian(self.from_parent(belief.mean), turn.T @ belief.covariance @ turn)

    def facing(self, x: float, y: float) -> Pose2:
        """The same place with the x axis towards a point of the parent's frame."""
        return Pose2(self.x, self.y, math.atan2(y - self.y, x - self.x))


def wrapped(angle: ArrayLike) -> FloatArray:
    """The same angle in [-π, π)."""
    return np.asarray((np.asarray(angle) + math.pi) % (2 * math.pi) - math.pi)


def checked_pose(name: str, pose: Pose2) -> Pose2:
    """The same pose as plain floats, heading in [-π, π).

    Raises:
        ValueError: not three finite numbers.
    """
    values = [float(value) for value in pose]
    if len(values) != 3 or not all(map(math.isfinite, values)):
        got = ', '.join(f'{value:g}' for value in values)
        raise ValueError(f'Expected {name} to be x, y and heading, all finite, got ({got}).')
    return Pose2(values[0], values[1], float(wrapped(values[2])))
