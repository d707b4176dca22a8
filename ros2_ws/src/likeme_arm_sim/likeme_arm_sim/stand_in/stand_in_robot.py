"""A robot in pybullet that knows nothing of likeme_arm's planner: motors, contacts, limits."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pybullet
from numpy.typing import NDArray

from likeme_arm.real_arm.arm_config import ArmConfig
from likeme_arm.real_arm.urdf_files import package_folders, urdf_path
from likeme_arm_sim.gripper import Gripper
from likeme_arm_sim.kinematics import load_panda
from likeme_arm_sim.physics import GripperPhysics
from likeme_arm_sim.physics_world import TIME_STEP, PhysicsWorld
from likeme_arm_sim.stand_in.constraint_gripper import ConstraintGripper

Vector = NDArray[np.float64]

GAINS = 0.35
#: Of the motor of a finger, N m.
FINGER_FORCE = 1.0
#: N between two bodies from which on they touch.
CONTACT_FORCE = 0.05
#: Above a limit before it counts, as a share: a controller begins at measured speeds, which have
#: noise of contacts.
MARGIN = 0.05


class StandInRobot:
    """One arm, its gripper and what was counted.

    Attributes:
        collisions: what the arm touched that it must not, once each, in words.
        violations: limits that were broken, once each, in words.
        fastest, hardest: greatest share of a joint's limit of speed, and of acceleration.
    """

    def __init__(self, world: PhysicsWorld, config: ArmConfig) -> None:
        self._world, self._client, self.config = world, world.client, config
        self._panda = config.joints[0] == 'panda_joint1'
        # The Panda of pybullet: another URDF than the driver's, with fingers that grip.
        self.body = load_panda(self._client) if self._panda else self._load(config)
        infos = [
            self._client.getJointInfo(self.body, j)
            for j in range(self._client.getNumJoints(self.body))
        ]
        numbers = {info[1].decode(): info[0] for info in infos}
        self._links = {-1: 'base'} | {info[0]: info[12].decode() for info in infos}
        links = {name: number for number, name in self._links.items()}
        self._joints = [numbers[name] for name in config.joints]
        self._forces = [infos[j][10] or 100.0 for j in self._joints]
        self._lower = np.array([infos[j][8] for j in self._joints])
        self._upper = np.array([infos[j][9] for j in self._joints])
        self._gripper: Gripper | ConstraintGripper
        if self._panda:
            self._gripper = Gripper(self._client, self.body, GripperPhysics(force=10.0))
        else:
            tool = links[config.tool_frame]
            self._gripper = ConstraintGripper(world, self.body, tool, config)
        # Of fingers that have bodies, and hold by the constraint all the same.
        self._finger = None if self._panda else numbers.get(config.gripper.joint)
        for joint, angle in zip(self._joints, config.home, strict=True):
            self._client.resetJointState(self.body, joint, float(angle))
        self.target = ''
        self.collisions, self.violations = dict[str, int](), dict[str, int]()
        self.fastest = self.hardest = 0.0
        if isinstance(self._gripper, Gripper):
            self._gripper.reset()
        self.grip(config.gripper.positions[0])
        self._pairs = self._separate_links([info[16] for info in infos])

    @property
    def joints(self) -> Vector:
        """Measured, rad."""
        return np.array([s[0] for s in self._client.getJointStates(self.body, self._joints)])

    @property
    def velocities(self) -> Vector:
        """Measured, rad/s."""
        return np.array([s[1] for s in self._client.getJointStates(self.body, self._joints)])

    @property
    def gripper_position(self) -> float:
        """Of the joint that the configuration names."""
        if isinstance(self._gripper, Gripper):
            return self._gripper.fingers[0]
        return self.config.gripper.position(self._gripper.width)

    def grip(self, position: float) -> None:
        """Command the gripper's joint."""
        self._gripper.command(self.config.gripper.width_at(position))

    def step(self, joints: Vector, velocities: Vector, accelerations: Vector) -> None:
        """Drive the motors towards what is commanded for one physics step, and count."""
        self._client.setJointMotorControlArray(
            self.body, self._joints, pybullet.POSITION_CONTROL,
            targetPositions=joints.tolist(), targetVelocities=velocities.tolist(),
            forces=self._forces, positionGains=[GAINS] * len(self._joints),
        )  # fmt: skip
        if isinstance(self._gripper, ConstraintGripper):
            self._gripper.advance(TIME_STEP)
            if self._finger is not None:
                self._client.setJointMotorControl2(
                    self.body, self._finger, pybullet.POSITION_CONTROL,
                    targetPosition=self.gripper_position, force=FINGER_FORCE,
                )  # fmt: skip
        self._world.step()
        self._count_limits(joints, velocities, accelerations)
        self._count_contacts()

    def _count_limits(self, commanded: Vector, rates: Vector, changes: Vector) -> None:
        config = self.config
        speed = np.abs(rates) / config.max_velocity
        change = np.abs(changes) / config.max_acceleration
        self.fastest = max(self.fastest, float(speed.max()))
        self.hardest = max(self.hardest, float(change.max()))
        for what, share in (('speed', speed), ('acceleration', change)):
            for joint in np.flatnonzero(share > 1.0 + MARGIN):
                self._violate(f'{what} of {config.joints[joint]}')
        outside = (commanded < self._lower) | (commanded > self._upper)
        for joint in np.flatnonzero(outside):
            self._violate(f'position of {config.joints[joint]}')

    def _violate(self, what: str) -> None:
        self.violations[what] = self.violations.get(what, 0) + 1

    def _count_contacts(self) -> None:
        toys = {body: name for name, body in self._world.toys.items()}
        toys |= {self._world.table: 'table', self._world.floor: 'floor'}
        for contact in self._client.getContactPoints(bodyA=self.body):
            other, link = contact[2], self._links[contact[3]]
            if other == self.body or contact[9] < CONTACT_FORCE:
                continue
            name = toys.get(other, '?')
            if name != self.target and not (name in ('table', 'floor') and contact[3] < 0):
                what = f'{link} and {name}'
                self.collisions[what] = self.collisions.get(what, 0) + 1

    def count_self_collisions(self) -> None:
        """Count links of the arm that touch each other now."""
        for a, b in self._pairs:
            if self._touch(a, b):
                what = f'{self._links[a]} and {self._links[b]}'
                self.collisions[what] = self.collisions.get(what, 0) + 1

    def _touch(self, a: int, b: int) -> bool:
        return bool(self._client.getClosestPoints(self.body, self.body, 0.0, a, b))

    def _separate_links(self, parents: list[int]) -> list[tuple[int, int]]:
        """Pairs of links but neighbours, fingers, and those that touch at home."""
        count = len(parents)
        pairs = [(a, b) for a in range(-1, count) for b in range(a + 1, count)]
        fingers = set(self.config.finger_links)
        return [
            (a, b)
            for a, b in pairs
            if parents[b] != a
            and not {self._links[a], self._links[b]} <= fingers
            and not self._touch(a, b)
        ]

    def _load(self, config: ArmConfig) -> int:
        """A URDF whose package:// URIs bullet would not find."""
        path = urdf_path(config.urdf)
        text = path.read_text(encoding='utf-8')
        for folder in package_folders(path):
            if text.find('package://') >= 0 and _resolves(text, Path(folder)):
                text = text.replace('package://', f'{folder}/')
        with tempfile.NamedTemporaryFile('w', suffix='.urdf') as file:
            file.write(text)
            file.flush()
            x, y, z, yaw = config.base
            return int(
                self._client.loadURDF(
                    file.name, (x, y, z), pybullet.getQuaternionFromEuler((0, 0, yaw)),
                    useFixedBase=True, flags=pybullet.URDF_IGNORE_VISUAL_SHAPES,
                )
            )  # fmt: skip


def _resolves(text: str, folder: Path) -> bool:
    first = text.partition('package://')[2].partition('"')[0]
    return (folder / first).is_file()
