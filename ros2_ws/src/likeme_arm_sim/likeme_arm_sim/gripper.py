"""The Panda's two fingers: one motor, and nothing between them that is felt but its width."""

from __future__ import annotations

from typing import Any

import pybullet

from likeme_arm_sim.kinematics import FINGER_JOINTS, GRASP_LINK
from likeme_arm_sim.physics import GripperPhysics

# Between the fingers, m.
OPEN_WIDTH = 0.08
# Narrower than any toy: closing to less means that nothing is between the fingers, m.
EMPTY_WIDTH = 0.012
# Of a finger, from where it shall be: it is there, m.
OPENED = 0.0005


class Gripper:
    """The fingers of one arm, told how far to be apart; time has to pass until they are."""

    def __init__(self, client: Any, body: int, physics: GripperPhysics) -> None:
        self._client, self._body, self._physics = client, body, physics
        self._goal = OPEN_WIDTH
        self._prepare()

    def reset(self) -> None:
        """Put the fingers open: only for setting the table up."""
        for joint in FINGER_JOINTS:
            self._client.resetJointState(self._body, joint, OPEN_WIDTH / 2)

    @property
    def fingers(self) -> tuple[float, float]:
        """How far each finger is from the middle, m."""
        left, right = self._client.getJointStates(self._body, FINGER_JOINTS)
        return float(left[0]), float(right[0])

    @property
    def width(self) -> float:
        """Between the fingers, m."""
        return sum(self.fingers)

    @property
    def there(self) -> bool:
        """Whether the fingers are as far apart as they were told."""
        return max(abs(finger - self._goal / 2) for finger in self.fingers) < OPENED

    @property
    def holding(self) -> bool:
        """Whether something keeps the closed fingers apart: all that a gripper can know."""
        return self._goal == 0.0 and self.width > EMPTY_WIDTH

    def command(self, width: float) -> None:
        """Have the fingers go to `width` m from one another."""
        self._goal = width
        for joint in FINGER_JOINTS:
            self._client.setJointMotorControl2(
                self._body,
                joint,
                pybullet.POSITION_CONTROL,
                targetPosition=width / 2,
                force=self._physics.force,
                maxVelocity=self._physics.speed,
            )

    def _prepare(self) -> None:
        (left, right), body, physics = FINGER_JOINTS, self._body, self._physics
        for joint in FINGER_JOINTS:
            self._client.changeDynamics(
                body,
                joint,
                lateralFriction=physics.friction,
                spinningFriction=physics.spinning_friction,
            )
        # The real hand drives both fingers with one motor; the URDF's mimic tag is not read.
        gear = self._client.createConstraint(
            body, left, body, right, pybullet.JOINT_GEAR, (1, 0, 0), (0, 0, 0), (0, 0, 0)
        )
        self._client.changeConstraint(gear, gearRatio=-1, erp=0.1, maxForce=physics.gear_force)
        assert self._client.getJointInfo(body, GRASP_LINK)[12] == b'panda_grasptarget'
