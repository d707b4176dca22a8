"""What a joint trajectory controller commands at a time, and faults that it may have.

Behaves as ros2_control's joint_trajectory_controller of Jazzy (release 4.42) does by default:

- A trajectory replaces the one before at its arrival. One that ends in the past or moves at its
  last point is refused; the one before goes on.
- Stamp 0: it starts when it arrives. Another stamp: it is in phase with that; points that are past
  are passed over, and if the first one is, the arm is commanded at once where it is due.
- Up to the first point it goes from the *measured* joints and speeds at the arrival, with no
  acceleration; with `interpolate_from_desired_state` from what was commanded last.
- Between points it is quintic where accelerations are told, cubic where they are not. (Points
  without speeds, between which it is linear, are not supported here.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

#: Fastest joint at the last point of a trajectory, rad/s.
STOPPED_SPEED = 1e-6


class FaultKind(StrEnum):
    """What goes wrong."""

    #: The trajectory is not begun.
    DROP = 'drop'
    #: It ends on the way, and the arm stands.
    ABORT = 'abort'
    #: The arm stands for `amount` s and then goes on.
    STALL = 'stall'
    #: It is followed `amount` times as slowly.
    SLOW = 'slow'
    #: It begins `amount` s late.
    LATE = 'late'
    #: A joint is pushed off by `amount` rad.
    BUMP = 'bump'
    #: joint_states stay away for `amount` s.
    SILENT = 'silent'


class Fault(NamedTuple):
    """A fault in the n-th trajectory from now (0: the next), `at` s after its begin."""

    kind: FaultKind
    trajectory: int
    at: float
    amount: float


class Spline(NamedTuple):
    """Points of the joints over time.

    Attributes:
        time: of each point, s, increasing, (T,).
        positions, velocities: (T, J), rad, rad/s.
        accelerations: rad/s^2; None: not told.
    """

    time: Vector
    positions: Vector
    velocities: Vector
    accelerations: Vector | None = None

    def at(self, time: float) -> tuple[Vector, Vector, Vector]:
        """Joints, speeds and accelerations at a time; at rest before and after."""
        rest = np.zeros(self.positions.shape[1])
        if time <= self.time[0]:
            return self.positions[0], self.velocities[0], rest
        if time >= self.time[-1]:
            return self.positions[-1], rest, rest
        i = int(np.searchsorted(self.time, time, side='right')) - 1
        width = float(self.time[i + 1] - self.time[i])
        powers = _powers(self, i, width)
        u = (time - self.time[i]) / width
        orders = np.arange(len(powers))
        joints = (u**orders) @ powers
        speed = (orders[1:] * u ** orders[:-1]) @ powers[1:]
        change = (orders[2:] * orders[1:-1] * u ** orders[:-2]) @ powers[2:]
        return joints, speed / width, change / width**2


def spline_of(message: Any, joints: Sequence[str]) -> Spline:
    """The points of a trajectory_msgs/JointTrajectory, in an order of the joints."""
    order = [list(message.joint_names).index(name) for name in joints]
    points = message.points

    def column(name: str) -> Vector:
        return np.array([getattr(point, name) for point in points])[:, order]

    starts = [p.time_from_start.sec + p.time_from_start.nanosec * 1e-9 for p in points]
    told = all(len(point.accelerations) for point in points)
    return Spline(
        np.array(starts), column('positions'), column('velocities'),
        column('accelerations') if told else None,
    )  # fmt: skip


@dataclass
class _Running:
    """A trajectory under way; clock: s after its arrival."""

    spline: Spline
    clock: float = 0.0
    fault: Fault | None = None


class TrajectoryFollower:
    """The commanded joints over time.

    Attributes:
        joints, velocities, accelerations: commanded now.
        aborted: whether the last trajectory ended by a fault on the way.
        silent_until: time of the follower's clock until which joint_states stay away, s.
    """

    def __init__(self, joints: Vector) -> None:
        self.joints, self.velocities = joints.copy(), np.zeros(len(joints))
        self.accelerations = np.zeros(len(joints))
        self.now, self.silent_until = 0.0, 0.0
        self._running: _Running | None = None
        self.aborted = False
        self._fault: Fault | None = None
        self._offset = np.zeros(len(joints))

    @property
    def under_way(self) -> bool:
        """Whether a trajectory has not ended."""
        return self._running is not None

    def halt(self) -> None:
        """End the trajectory and stay, as a controller does whose goal is cancelled."""
        self._running = None
        self.velocities, self.accelerations = np.zeros((2, len(self.joints)))

    def inject(self, fault: Fault | None) -> None:
        """A fault of a later trajectory; None: none any more."""
        self._fault = fault
        self._offset[:] = 0.0

    def replace(
        self,
        spline: Spline,
        measured: tuple[Vector, Vector] | None = None,
        age: float | None = None,
    ) -> bool:
        """Take in a trajectory; whether it was not refused.

        Args:
            spline: without the point where the arm is.
            measured: joints and speeds; None: those commanded last are taken for them.
            age: s since the time that the trajectory's stamp tells; None: it starts now.
        """
        passed = 0.0 if age is None else age
        if spline.time[-1] < passed or np.abs(spline.velocities[-1]).max() > STOPPED_SPEED:
            return False
        fault, self.aborted = self._fault, False
        if fault is not None:
            self._fault = fault._replace(trajectory=fault.trajectory - 1)
            if fault.trajectory == 0:
                self._fault = None
            else:
                fault = None
        if fault is not None and fault.kind is FaultKind.DROP:
            return True
        joints, speeds = (self.joints, self.velocities) if measured is None else measured
        if self._offset.any():
            # Whoever pushed a joint off its way lets go; how fast it was pushed is not counted.
            speeds = self.velocities
        self._offset[:] = 0.0
        late = fault.amount if fault is not None and fault.kind is FaultKind.LATE else 0.0
        self._running = _Running(_joined(joints, speeds, spline, passed), -late, fault)
        return True

    def advance(self, step: float) -> None:
        """Go on by one control step, s."""
        self.now += step
        running = self._running
        if running is None:
            self.velocities, self.accelerations = np.zeros((2, len(self.joints)))
            return
        rate = self._rate(running)
        if self.aborted:
            self.halt()
            return
        running.clock += step * rate
        joints, velocities, accelerations = running.spline.at(max(running.clock, 0.0))
        moves = rate if running.clock > 0 else 0.0
        self.joints = joints + self._offset
        self.velocities, self.accelerations = velocities * moves, accelerations * moves**2
        if running.clock >= running.spline.time[-1]:
            self._running = None

    def _rate(self, running: _Running) -> float:
        """How fast the trajectory's time goes; the fault's doing."""
        fault = running.fault
        if fault is None or running.clock < fault.at:
            return 1.0
        if fault.kind is FaultKind.SLOW:
            return 1.0 / fault.amount
        if fault.kind is FaultKind.ABORT:
            self.aborted = True
            return 0.0
        if fault.kind is FaultKind.STALL:
            running.fault = fault._replace(amount=fault.amount - 1 / 240)
            return 0.0 if fault.amount > 0 else 1.0
        if fault.kind is FaultKind.BUMP:
            self._offset[0] += fault.amount
        if fault.kind is FaultKind.SILENT:
            self.silent_until = self.now + fault.amount
        running.fault = None
        return 1.0


def _joined(joints: Vector, speeds: Vector, spline: Spline, passed: float) -> Spline:
    """A trajectory that `passed` s ago began, from the arm's state now; time: s from now."""
    time = spline.time - passed
    if time[0] <= 0:
        return spline._replace(time=time)
    accelerations = spline.accelerations
    if accelerations is not None:
        accelerations = np.vstack([np.zeros(len(joints)), accelerations])
    return Spline(
        np.concatenate([[0.0], time]), np.vstack([joints, spline.positions]),
        np.vstack([speeds, spline.velocities]), accelerations,
    )  # fmt: skip


def _powers(spline: Spline, i: int, width: float) -> Vector:
    """Coefficients of the powers of u from 0 to 1 in the i-th segment, (4 or 6, J)."""
    p0, way = spline.positions[i], spline.positions[i + 1] - spline.positions[i]
    v0, v1 = spline.velocities[i] * width, spline.velocities[i + 1] * width
    if spline.accelerations is None:
        return np.array([p0, v0, 3 * way - 2 * v0 - v1, v0 + v1 - 2 * way])
    a0, a1 = spline.accelerations[i] * width**2, spline.accelerations[i + 1] * width**2
    return np.array([
        p0, v0, a0 / 2,
        10 * way - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
        -15 * way + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
        6 * way - 3 * (v0 + v1) - 0.5 * (a0 - a1),
    ])  # fmt: skip
