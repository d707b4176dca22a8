"""The gripper: two fingers with one motor, whose only measurement is their distance."""

from __future__ import annotations

from typing import Any

import pybullet

from likeme_arm_sim.kinematics import FINGER_JOINTS, GRASP_LINK
from likeme_arm_sim.physics import GripperPhysics

# Between the open fingers, m.
OPEN_WIDTH = 0.08
# Narrower than any toy: if the fingers close to less, nothing is between them, m.
EMPTY_WIDTH = 0.012
# Distance of a finger from its target at which it is reached, m.
POSITION_TOLERANCE = 0.0005


class Gripper:
    """Position control of the fingers; a command takes simulated time."""

    def __init__(self, client: Any, body: int, physics: GripperPhysics) -> None:
        self._client, self._body, self._physics = client, body, physics
        self._goal = OPEN_WIDTH
        self._prepare()

    def reset(self) -> None:
        """Open the fingers at once: for setting up the table only."""
        for joint in FINGER_JOINTS:
            self._client.resetJointState(self._body, joint, OPEN_WIDTH / 2)

    @property
    def fingers(self) -> tuple[float, float]:
        """Distance of each finger from the middle, m."""
        left, right = self._client.getJointStates(self._body, FINGER_JOINTS)
        return float(left[0]), float(right[0])

    @property
    def width(self) -> float:
        """Between the fingers, m."""
        return sum(self.fingers)

    @property
    def at_goal(self) -> bool:
        """Whether the fingers have reached the commanded width."""
        return max(abs(finger - self._goal / 2) for finger in self.fingers) < POSITION_TOLERANCE

    @property
    def holding(self) -> bool:
        """Whether something keeps the closed fingers apart."""
        return self._goal == 0.0 and self.width > EMPTY_WIDTH

    def command(self, width: float) -> None:
        """Command a width between the fingers, m."""
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
