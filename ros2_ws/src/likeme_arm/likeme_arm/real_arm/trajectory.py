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

    @property
    def last_rest(self) -> int:
        """The last point at which it still rests at its begin."""
        gone = np.flatnonzero(self.s > self.s[0])
        return int(gone[0]) - 1 if len(gone) else len(self.s) - 1

    def after(self, rest: float) -> Trajectory:
        """The same after some s of rest at its begin."""
        count = int(np.ceil(rest / PERIOD))
        joints = np.repeat(self.joints[:1], count, axis=0)
        still, none = np.zeros_like(joints), np.zeros(count)
        time: Vector = np.arange(count + len(self.time), dtype=float) * PERIOD
        return replace(
            self, time=time,
            joints=np.vstack([joints, self.joints]),
            velocities=np.vstack([still, self.velocities]),
            accelerations=np.vstack([still, self.accelerations]),
            s=np.append(none + self.s[0], self.s), s_velocity=np.append(none, self.s_velocity),
        )  # fmt: skip

    def index_at(self, elapsed: float) -> int:
        """The point at a time after the start."""
        return int(np.clip(round(elapsed / PERIOD), 0, len(self.time) - 1))

    def time_at(self, s: float) -> float:
        """When it gets to a parameter of the path, s; its end may be rounded away."""
        return float(self.time[min(int(np.searchsorted(self.s, s)), len(self.s) - 1)])

    def between(self, begin: float, end: float, most: int) -> tuple[Vector, Vector]:
        """Joints and speeds at no more than so many points from one time to another, (N, J)."""
        first, last = self.index_at(begin), self.index_at(end)
        points = np.linspace(first, last, min(last - first + 1, most)).round().astype(int)
        return self.joints[points], self.velocities[points]

    def to_rest(self, s: float, duration: float) -> Trajectory:
        """From wherever the arm is to rest at a parameter of the path."""
        joints = np.repeat(self.path.at(np.array([s])), 2, axis=0)
        rest = np.zeros_like(joints)
        return replace(
            self, time=np.array([0.0, duration]), joints=joints, velocities=rest,
            accelerations=rest, s=np.array([s, s]), s_velocity=np.zeros(2),
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
