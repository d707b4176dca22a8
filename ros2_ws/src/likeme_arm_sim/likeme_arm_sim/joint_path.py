"""Paths through joint space, and the speed profile along them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_arm.tool_pose import NoSolutionError
from likeme_arm_sim.kinematics import Vector
from likeme_arm_sim.physics_world import TIME_STEP


class JointPath(NamedTuple):
    """Joint waypoints along a path.

    Attributes:
        distance: of each waypoint along the path, increasing, (N,), m (or rad).
        joints: at each waypoint, (N, 7), rad.
        failure: why the path ends before its goal; None if it does not.
    """

    distance: Vector
    joints: Vector
    failure: NoSolutionError | None = None

    def after(self, distance: float) -> JointPath:
        """The rest of a complete path after a distance; at least its last segment."""
        first = int(np.searchsorted(self.distance, distance))
        first = min(first, len(self.distance) - 2)
        return JointPath(self.distance[first:] - self.distance[first], self.joints[first:])

    def greatest_speed(self, limits: Vector) -> float:
        """The greatest speed that keeps every joint within its limit (7,), rad/s."""
        rates = np.abs(np.diff(self.joints, axis=0)) / np.diff(self.distance)[:, None]
        return float(np.min(limits / np.maximum(rates.max(0), 1e-6)))

    def at(self, distance: Vector) -> Vector:
        """Joints at each of the distances (S,), (S, 7), rad."""
        return np.stack([np.interp(distance, self.distance, each) for each in self.joints.T], 1)


def trapezoidal_profile(length: float, speed: float, acceleration: float) -> Vector:
    """Distance after each control step of a motion from rest to rest, m (or rad).

    The speed profile is a trapezoid whose corners are rounded over 0.1 s, to limit jerk.
    """
    if length < 1e-9:
        return np.zeros(1)
    speed = min(speed, np.sqrt(length * acceleration))
    ramp, duration = speed / acceleration, length / speed + speed / acceleration
    time = np.arange(0.0, duration + TIME_STEP, TIME_STEP)
    velocity = np.clip(np.minimum(time, duration - time) / max(ramp, TIME_STEP), 0.0, 1.0)
    smooth = np.convolve(velocity, np.hanning(26)[1:-1])
    distance = np.cumsum(smooth)
    return np.asarray(distance * (length / distance[-1]))
