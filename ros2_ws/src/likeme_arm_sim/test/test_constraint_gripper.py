"""Fingers that hold by a constraint: what lies between them when they close, until they open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('pinocchio', reason='scripts/real_arm.lock is not installed')

from likeme_arm.real_arm.arm_config import load_arm_config
from likeme_arm.real_arm.arm_kinematics import ArmKinematics
from likeme_arm_sim.physics_world import TIME_STEP, PhysicsWorld
from likeme_arm_sim.stand_in.stand_in_robot import StandInRobot
from likeme_arm_sim.toys import toys_of
from likeme_core.paper_world import WORLD

UR5 = load_arm_config('ur5_gripper')
OPEN, CLOSED = UR5.gripper.positions


class Table:
    """The arm over the table, its fingers around or beside a lemon that floats."""

    def __init__(self, beside: float = 0.0) -> None:
        self.world = PhysicsWorld(WORLD.table, toys_of(WORLD))
        self.robot = StandInRobot(self.world, replace(UR5, home=UR5.ready))
        self.joints = UR5.ready
        grasp = self.fingers()
        height = grasp[2] - self.world.resting_height('lemon')
        self.world.put_toy('lemon', grasp[0] + beside, grasp[1], height, 0.0)
        self.world.client.setGravity(0, 0, 0)

    def fingers(self) -> np.ndarray:
        return ArmKinematics(UR5).tool_pose(self.joints).position

    def lemon(self) -> np.ndarray:
        return self.world.toy_pose('lemon').position

    def width(self) -> float:
        return UR5.gripper.width_at(self.robot.gripper_position)

    def run(self, seconds: float, turn: float = 0.0) -> None:
        """Let time pass while the first joint turns by an angle, rad."""
        rate = np.eye(6)[0] * turn / seconds
        for _ in range(round(seconds / TIME_STEP)):
            self.joints = self.joints + rate * TIME_STEP
            self.robot.step(self.joints, rate, np.zeros(6))


def test_a_toy_between_closing_fingers_goes_with_them_until_they_open() -> None:
    table = Table()
    table.robot.grip(CLOSED)
    table.run(1.0)
    assert table.width() == pytest.approx(table.world.width('lemon'), abs=1e-3)
    before = table.lemon()
    table.world.client.setGravity(0, 0, -9.81)
    table.run(1.0, turn=0.3)
    held = table.lemon()
    assert np.linalg.norm(held - before) > 0.05
    assert np.linalg.norm(held - table.fingers()) < 0.02
    table.robot.grip(OPEN)
    table.run(0.2)
    assert table.lemon()[2] < held[2] - 0.05
    table.run(0.5)
    assert table.width() == pytest.approx(UR5.gripper.width)


def test_fingers_that_meet_nothing_close() -> None:
    table = Table(beside=0.06)
    table.robot.grip(CLOSED)
    table.run(1.2)
    assert table.width() == pytest.approx(0.0, abs=1e-6)


def test_a_finger_that_has_a_body_goes_with_the_width() -> None:
    config = load_arm_config('so101')
    robot = StandInRobot(PhysicsWorld(WORLD.table, toys_of(WORLD)), config)
    for position in config.gripper.positions:
        robot.grip(position)
        for _ in range(round(1.2 / TIME_STEP)):
            robot.step(config.home, np.zeros(5), np.zeros(5))
        finger = robot._client.getJointState(robot.body, robot._finger)[0]
        assert finger == pytest.approx(position, abs=0.05)
