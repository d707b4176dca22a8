"""Fingers for a URDF that has none that move: they hold what lies between them when they close."""

from __future__ import annotations

import numpy as np
import pybullet
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from likeme_arm.real_arm.arm_config import ArmConfig
from likeme_arm_sim.physics_world import PhysicsWorld, Pose

#: Of the width between the fingers, m/s.
SPEED = 0.1
#: How far an object's centre may be from the grasp point: along the fingers' flat side, and along
#: the fingers, m.
ALONG, DEEP = 0.03, 0.035


class ConstraintGripper:
    """Two fingers without bodies at a configuration's grasp point, which close along its y.

    An object between them is fixed to the tool's link once they are as close as it is wide, and
    let go once they open.

    Attributes:
        width: between the fingers, m.
    """

    def __init__(self, world: PhysicsWorld, body: int, link: int, config: ArmConfig) -> None:
        self._world, self._client, self._body, self._link = world, world.client, body, link
        self._grasp_point = np.eye(4)
        self._grasp_point[:3, 3] = config.tool_offset[:3]
        self._grasp_point[:3, :3] = Rotation.from_euler('xyz', config.tool_offset[3:]).as_matrix()
        self.width = self._goal = config.gripper.width
        self._constraint: int | None = None

    def command(self, width: float) -> None:
        """Command a width between the fingers, m."""
        self._goal = width

    def advance(self, seconds: float) -> None:
        """Move the fingers for some s."""
        if self._constraint is not None:
            if self._goal <= self.width:
                return
            self._client.removeConstraint(self._constraint)
            self._constraint = None
        step = SPEED * seconds
        closing = self._goal < self.width
        self.width += min(max(self._goal - self.width, -step), step)
        if closing:
            self._hold()

    def _hold(self) -> None:
        """Hold the object that the fingers have just met, if there is one."""
        mass, mass_turn, _, _, place, turn = self._client.getLinkState(self._body, self._link)
        link = Pose(np.array(place), np.array(turn)).matrix()
        for name, toy in self._world.toys.items():
            pose = self._world.toy_pose(name).matrix()
            x, y, z = np.abs(np.linalg.inv(link @ self._grasp_point) @ pose[:, 3])[:3]
            if (
                self.width <= self._world.width(name)
                and x < ALONG
                and y < self.width / 2
                and z < DEEP
            ):
                # Bullet has the joint's frame in that of the link's centre of mass.
                centre = Pose(np.array(mass), np.array(mass_turn)).matrix()
                self._constraint = self._fix(toy, np.linalg.inv(centre) @ pose)
                return

    def _fix(self, toy: int, pose: NDArray[np.float64]) -> int:
        """Fix a toy to the link at a pose in the frame of the link's centre of mass."""
        return int(
            self._client.createConstraint(
                self._body, self._link, toy, -1, pybullet.JOINT_FIXED, (0, 0, 0),
                pose[:3, 3].tolist(), (0, 0, 0),
                Rotation.from_matrix(pose[:3, :3]).as_quat().tolist(), (0, 0, 0, 1),
            )
        )  # fmt: skip
