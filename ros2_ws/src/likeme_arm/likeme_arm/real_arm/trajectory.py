"""Trajectories of the joints: a path through joint space, timed by Ruckig.

The path is q(s), s its parameter; s(t) goes from rest to rest within limits of speed, acceleration
and jerk that keep every joint within its own: dq/dt = q' s', d2q/dt2 = q'' s'^2 + q' s''.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from likeme_arm.tool_pose import Vector

#: s between two points of a trajectory.
PERIOD = 0.02
#: Of a stop, s; and s that building up the deceleration takes.
LEAST_TIME, JERK_TIME = 0.1, 0.05
#: Share of the joints' limits that is used: the rest is for the controller's interpolation.
SHARE = 0.9
#: Share of a joint's acceleration for the curvature of a path that has one, the rest is for s''.
CURVATURE_SHARE = 0.5
#: Points of the path at which the limits of s are computed.
POINTS = 200


@dataclass(frozen=True, eq=False)
class JointPath:
    """A path through joint space, q(s) for s from 0 to `length`.

    Attributes:
        s: parameter of each waypoint, (N,), increasing from 0; m, or rad of the slowest joint.
        joints: at each waypoint, (N, J), rad.
    """

    s: Vector
    joints: Vector

    @property
    def length(self) -> float:
        """The last parameter."""
        return float(self.s[-1])

    @cached_property
    def _curve(self) -> Any:
        from scipy.interpolate import CubicSpline, make_interp_spline

        if len(self.s) == 2:
            return make_interp_spline(self.s, self.joints, k=1)
        return CubicSpline(self.s, self.joints)

    def at(self, s: Vector, derivative: int = 0) -> Vector:
        """q, q' or q'' at each parameter, (S, J)."""
        if derivative == 2 and len(self.s) == 2:
            return np.zeros((len(s), self.joints.shape[1]))
        return np.asarray(self._curve(s, derivative))


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Joint angles over time, from rest to rest.

    Attributes:
        time: of each point, s from the start, (T,).
        joints, velocities, accelerations: (T, J), rad, rad/s, rad/s^2.
        path: on which they lie. s, s_velocity: parameter of the path at each point, (T,).
        limits: of s', s'', s'''.
    """

    time: Vector
    joints: Vector
    velocities: Vector
    accelerations: Vector
    path: JointPath
    s: Vector
    s_velocity: Vector
    limits: tuple[float, float, float]

    @property
    def duration(self) -> float:
        """s."""
        return float(self.time[-1])

    def index_at(self, elapsed: float) -> int:
        """The point at a time after the start."""
        return int(np.clip(round(elapsed / PERIOD), 0, len(self.time) - 1))

    def staying(self, elapsed: float) -> Trajectory:
        """At rest where the trajectory is after some time."""
        return self._to_rest(float(self.s[self.index_at(elapsed)]), LEAST_TIME)

    def stopping(self, reached: float, elapsed: float) -> Trajectory | None:
        """To rest further on the path, from anywhere between two times of the trajectory.

        Where the controller is between them is not known: what was measured is behind, and what
        is due may be ahead of it. By a cubic from there at the path's speed v to rest in T, no
        joint moves faster than v if T >= 1.5 L / v for the longest way L, nor back if T <= 3 d / v
        for the shortest way d: both hold if d is at least half of L.

        None: the trajectory ends by itself as soon.
        """
        first, last = self.index_at(reached), self.index_at(elapsed)
        behind, ahead = float(self.s[first]), float(self.s[last])
        speed = max(float(self.s_velocity[first : last + 1].max()), 1e-6)
        way = max(speed**2 / (2 * self.limits[1]) + JERK_TIME * speed, ahead - behind)
        goal = min(self.path.length, ahead + way)
        time = max(1.5 * (goal - behind) / speed, LEAST_TIME)
        return None if self.duration - elapsed <= time else self._to_rest(goal, time)

    def _to_rest(self, s: float, time: float) -> Trajectory:
        joints = np.repeat(self.path.at(np.array([s])), 2, axis=0)
        rest = np.zeros_like(joints)
        return replace(
            self, time=np.array([0.0, time]), joints=joints, velocities=rest, accelerations=rest,
            s=np.array([s, s]), s_velocity=np.zeros(2),
        )  # fmt: skip


def joint_path(start: Vector, goal: Vector) -> JointPath:
    """The straight way through joint space."""
    length = max(float(np.abs(goal - start).max()), 1e-6)
    return JointPath(np.array([0.0, length]), np.array([start, goal]))


def timed(
    path: JointPath,
    velocity: Vector,
    acceleration: Vector,
    jerk: Vector,
    speed: float = np.inf,
) -> Trajectory:
    """A path from rest to rest as fast as the joints' limits and `speed` (of s, 1/s) allow."""
    s = np.linspace(0.0, path.length, POINTS)
    first, second = np.abs(path.at(s, 1)).max(0), np.abs(path.at(s, 2)).max(0)
    first, second = np.maximum(first, 1e-9), np.maximum(second, 1e-9)
    straight = len(path.s) == 2
    limits = (
        min(
            speed,
            SHARE * float((velocity / first).min()),
            float(np.sqrt(CURVATURE_SHARE * SHARE * acceleration / second).min()),
        ),
        (1.0 if straight else 1.0 - CURVATURE_SHARE) * SHARE * float((acceleration / first).min()),
        SHARE * float((jerk / first).min()),
    )
    return _timed(path, limits)


def _timed(path: JointPath, limits: tuple[float, float, float]) -> Trajectory:
    import ruckig

    given = ruckig.InputParameter(1)
    given.current_position, given.target_position = [0.0], [path.length]
    given.current_velocity = given.current_acceleration = [0.0]
    given.target_velocity = given.target_acceleration = [0.0]
    given.max_velocity, given.max_acceleration, given.max_jerk = ([limit] for limit in limits)
    profile = ruckig.Trajectory(1)
    result = ruckig.Ruckig(1).calculate(given, profile)
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise RuntimeError(f'Ruckig found no profile for {given}: {result}.')
    count = max(2, int(np.ceil(profile.duration / PERIOD)) + 1)
    time: Vector = np.arange(count, dtype=float) * PERIOD
    states = [profile.at_time(min(t, profile.duration)) for t in time]
    along = np.array([[p[0], v[0], a[0]] for p, v, a in states])
    # The last point is at rest, also where the profile ended between two points.
    along[-1, 1:] = 0.0
    at, rate, change = along.T
    at = np.clip(at, 0.0, path.length)
    first, second = path.at(at, 1), path.at(at, 2)
    accelerations = second * rate[:, None] ** 2 + first * change[:, None]
    return Trajectory(
        time, path.at(at), first * rate[:, None], accelerations, path, at, rate, limits
    )
