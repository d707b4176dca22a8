"""The arm's joints as joint_states last told them."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from likeme_arm.real_arm.arm_config import ArmConfig
from likeme_arm.real_arm.motion_fault import MotionFaultError
from likeme_arm.tool_pose import Vector


class JointReading(NamedTuple):
    """Where the arm is.

    Attributes:
        joints, velocities: (J,), rad, rad/s.
        gripper: position of its joint; NaN: not told.
        way: greatest way of a joint within the last REST_TIME, rad; infinite: not known.
    """

    joints: Vector
    velocities: Vector
    gripper: float
    way: float = float('inf')

    @property
    def at_rest(self) -> bool:
        """Whether no joint of the arm moves, by the speeds that are told or by the positions.

        Speeds are noisy where something presses on the arm or on what it holds.
        """
        slow = np.abs(self.velocities).max() < REST_SPEED
        return bool(slow or self.way < REST_SPEED * REST_TIME)


#: Fastest joint of an arm at rest, rad/s; s.
REST_SPEED, REST_TIME = 0.03, 0.1


class ArmState:
    """What was heard last. Every method may be called from any thread."""

    def __init__(self, config: ArmConfig, clock: Callable[[], float] = time.monotonic) -> None:
        """clock: monotonic, s."""
        self._config, self._clock = config, clock
        self._changed = threading.Condition()
        self._reading: JointReading | None = None
        self._heard, self._gripper = 0.0, float('nan')
        self._past = deque[tuple[float, Vector]]()

    def hear(
        self, names: Sequence[str], positions: Sequence[float], velocities: Sequence[float]
    ) -> None:
        """Take in a message; one without the arm's joints may be that of the gripper.

        velocities: empty: not told; they then follow from the positions.
        """
        found = dict(zip(names, positions, strict=False))
        with self._changed:
            self._gripper = float(found.get(self._config.gripper.joint, self._gripper))
            if not all(name in found for name in self._config.joints):
                return
            joints = np.array([found[name] for name in self._config.joints])
            if not np.isfinite(joints).all():
                return
            now = self._clock()
            rates = dict(zip(names, velocities, strict=False))
            if all(name in rates for name in self._config.joints):
                speed = np.array([rates[name] for name in self._config.joints])
            elif self._reading is not None and now > self._heard:
                speed = (joints - self._reading.joints) / (now - self._heard)
            else:
                speed = np.zeros(len(joints))
            reading = JointReading(joints, speed, self._gripper, self._way(now, joints))
            self._reading, self._heard = reading, now
            self._changed.notify_all()

    def _way(self, now: float, joints: Vector) -> float:
        """Greatest way of a joint within REST_TIME, rad."""
        past = self._past
        past.append((now, joints))
        # The last one that is old enough stays.
        while len(past) > 1 and now - past[1][0] >= REST_TIME:
            past.popleft()
        if now - past[0][0] < REST_TIME:
            return float('inf')
        return float(np.ptp([each for _, each in past], axis=0).max())

    @property
    def now(self) -> float:
        """Of its clock, s."""
        return self._clock()

    @property
    def age(self) -> float:
        """s since the arm's joints were told; infinite: never."""
        with self._changed:
            return self._clock() - self._heard if self._reading is not None else float('inf')

    def read(self) -> JointReading:
        """The last reading.

        Raises:
            MotionFaultError: it is too old, or there is none.
        """
        with self._changed:
            limit = self._config.tolerances.state_timeout
            if self._reading is None:
                raise MotionFaultError(
                    f'Expected joint_states with {", ".join(self._config.joints)}, heard none.'
                )
            age = self._clock() - self._heard
            if age > limit:
                raise MotionFaultError(
                    f'Expected joint_states at least every {limit:g} s, got none for {age:.2f} s.'
                )
            return self._reading._replace(gripper=self._gripper)

    def wait(self, seconds: float) -> None:
        """Wait for the next reading, at most so long."""
        with self._changed:
            self._changed.wait(seconds)
