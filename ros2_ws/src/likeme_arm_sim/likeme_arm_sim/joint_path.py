"""Ways of an arm through joint space, and how far along them it is after each control step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_arm.tool_pose import NoSolutionError
from likeme_arm_sim.kinematics import Vector
from likeme_arm_sim.physics_world import TIME_STEP


class JointPath(NamedTuple):
    """Joint waypoints along a way.

    Attributes:
        distance: travelled at each of the waypoints, rising, (N,), m (or rad).
        joints: there, (N, 7), rad.
        failure: why the way ends before its goal; None when it does not.
    """

    distance: Vector
    joints: Vector
    failure: NoSolutionError | None = None

    def after(self, distance: float) -> JointPath:
        """What is left of a complete path behind a distance: the last piece at least."""
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
    """Distance after each control step of a motion that starts and ends at rest, m (or rad).

    The speed rises, stays and falls (trapezoid) and its corners are rounded over 0.1 s, so that
    nothing jerks.
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
