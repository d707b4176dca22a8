"""Whether an arm follows its trajectory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from likeme_arm.real_arm.arm_config import ArmConfig
from likeme_arm.real_arm.arm_state import JointReading
from likeme_arm.real_arm.motion_fault import MotionFaultError
from likeme_arm.real_arm.trajectory import Trajectory
from likeme_arm.tool_pose import Vector

#: Points of a trajectory that lie so near to the measured joints are all taken for reached, rad.
NEAR = 0.01


class Tracking:
    """Compares the measured joints with one trajectory.

    Attributes:
        reached: time on the trajectory where the arm is, s.
    """

    def __init__(self, trajectory: Trajectory, config: ArmConfig) -> None:
        self._trajectory, self._names = trajectory, config.joints
        self._limits = config.tolerances
        self._index, self.reached = 0, 0.0

    def follow(self, elapsed: float, reading: JointReading) -> bool:
        """Take in a reading; whether the arm has reached the goal and stands.

        elapsed: s since the trajectory was sent.

        Raises:
            MotionFaultError: it is beside the trajectory, too far behind, or has stopped.
        """
        trajectory, limits = self._trajectory, self._limits
        last = trajectory.index_at(elapsed)
        apart, near = self._distances(self._index, last, reading)
        if apart.min() > limits.tracking:
            raise MotionFaultError(self._beside(self._index + int(apart.argmin()), reading))
        self._index += int(near[-1])
        self.reached = float(trajectory.time[self._index])
        miss = float(np.abs(reading.joints - trajectory.joints[-1]).max())
        if elapsed >= trajectory.duration and miss <= limits.goal and reading.at_rest:
            return True
        # An arm that stands short of its goal will not get there later.
        due = elapsed if reading.at_rest else min(elapsed, trajectory.duration)
        behind = due - self.reached
        if behind > limits.lag:
            raise MotionFaultError(self._behind(behind, reading))
        if elapsed > trajectory.duration + limits.goal_time:
            raise MotionFaultError(
                f'Expected the arm at rest at its goal within {limits.goal_time:g} s, '
                f'got {miss:.3f} rad away from it.'
            )
        return False

    def about(self, elapsed: float, reading: JointReading) -> tuple[float, float]:
        """The times of the trajectory between which the arm is, also if it came back, s."""
        _, near = self._distances(0, self._trajectory.index_at(elapsed), reading)
        return float(self._trajectory.time[near[0]]), float(self._trajectory.time[near[-1]])

    def _distances(
        self, first: int, last: int, reading: JointReading
    ) -> tuple[Vector, NDArray[np.intp]]:
        """Of the arm from some points, rad; which of them it may be at."""
        apart: Vector = np.abs(self._trajectory.joints[first : last + 1] - reading.joints).max(1)
        return apart, np.flatnonzero(apart <= max(float(apart.min()), NEAR))

    def _beside(self, index: int, reading: JointReading) -> str:
        apart = np.abs(self._trajectory.joints[index] - reading.joints)
        worst = int(apart.argmax())
        return (
            f'Expected {self._names[worst]} within {self._limits.tracking:g} rad of its '
            f'trajectory, got {apart[worst]:.3f} rad.'
        )

    def _behind(self, behind: float, reading: JointReading) -> str:
        if reading.at_rest:
            return (
                f'The arm stopped at {self.reached:.2f} of {self._trajectory.duration:.2f} s of '
                'its trajectory: its controller dropped it or was stopped.'
            )
        return (
            f'Expected the arm at most {self._limits.lag:g} s behind its trajectory, '
            f'got {behind:.2f} s.'
        )
