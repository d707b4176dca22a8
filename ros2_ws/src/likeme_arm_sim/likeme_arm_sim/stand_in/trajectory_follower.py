"""What a joint trajectory controller commands at a time, and faults that it may have.

Behaves as ros2_control's joint_trajectory_controller: a new trajectory replaces the old one at
once, begins at what is commanded now, and is interpolated by cubic splines through its points.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


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


@dataclass
class _Running:
    """A trajectory under way; time: of its points, after its begin, s."""

    time: Vector
    positions: Vector
    velocities: Vector
    clock: float = 0.0
    fault: Fault | None = None


class TrajectoryFollower:
    """The commanded joints over time.

    Attributes:
        joints, velocities: commanded now.
        aborted: whether the last trajectory ended by a fault on the way.
        silent_until: time of the follower's clock until which joint_states stay away, s.
    """

    def __init__(self, joints: Vector) -> None:
        self.joints, self.velocities = joints.copy(), np.zeros(len(joints))
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
        self.velocities[:] = 0.0

    def inject(self, fault: Fault | None) -> None:
        """A fault of a later trajectory; None: none any more."""
        self._fault = fault
        self._offset[:] = 0.0

    def replace(self, time: Vector, positions: Vector, velocities: Vector) -> None:
        """Begin another trajectory at what is commanded now."""
        fault, self.aborted = self._fault, False
        if fault is not None:
            self._fault = fault._replace(trajectory=fault.trajectory - 1)
            if fault.trajectory == 0:
                self._fault = None
            else:
                fault = None
        if fault is not None and fault.kind is FaultKind.DROP:
            return
        self._running = _Running(
            np.concatenate([[0.0], time]),
            np.vstack([self.joints - self._offset, positions]),
            np.vstack([self.velocities, velocities]),
            -fault.amount if fault is not None and fault.kind is FaultKind.LATE else 0.0,
            fault,
        )

    def advance(self, step: float) -> None:
        """Go on by one control step, s."""
        self.now += step
        running = self._running
        if running is None:
            self.velocities[:] = 0.0
            return
        before = running.clock
        rate = self._rate(running)
        if self.aborted:
            self.halt()
            return
        running.clock += step * rate
        joints, velocities = _cubic(running, min(max(running.clock, 0.0), running.time[-1]))
        self.joints = joints + self._offset
        self.velocities = velocities * rate if running.clock > 0 else velocities * 0.0
        if rate == 0.0 and running.clock == before:
            self.velocities[:] = 0.0
        if running.clock >= running.time[-1]:
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


def _cubic(running: _Running, clock: float) -> tuple[Vector, Vector]:
    """Cubic Hermite interpolation between two points; joints and velocities."""
    time = running.time
    i = int(np.clip(np.searchsorted(time, clock, side='right') - 1, 0, len(time) - 2))
    width = time[i + 1] - time[i]
    u = (clock - time[i]) / width
    p0, p1 = running.positions[i], running.positions[i + 1]
    v0, v1 = running.velocities[i] * width, running.velocities[i + 1] * width
    joints = (
        (2 * u**3 - 3 * u**2 + 1) * p0 + (u**3 - 2 * u**2 + u) * v0
        + (-2 * u**3 + 3 * u**2) * p1 + (u**3 - u**2) * v1
    )  # fmt: skip
    slope = (
        (6 * u**2 - 6 * u) * p0 + (3 * u**2 - 4 * u + 1) * v0
        + (-6 * u**2 + 6 * u) * p1 + (3 * u**2 - 2 * u) * v1
    )  # fmt: skip
    return joints, slope / width
