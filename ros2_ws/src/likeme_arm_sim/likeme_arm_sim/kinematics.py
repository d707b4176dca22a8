"""Forward and inverse kinematics, with a copy of the arm in a pybullet client of its own.

The copy is not part of the simulation, so that setting its joints has no effect there.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pybullet
import pybullet_data
from numpy.typing import NDArray

from likeme_arm.tool_pose import NoSolutionError, ToolPose
from likeme_arm_sim.bullet import connect

Vector = NDArray[np.float64]

PANDA_URDF = Path(pybullet_data.getDataPath()) / 'franka_panda' / 'panda.urdf'
ARM_JOINTS = tuple(range(7))
FINGER_JOINTS = (9, 10)
GRASP_LINK = 11

# Folded backwards over the robot's right, hand down: no part of the arm covers the table in the
# camera's picture (test_arm.py projects it).
HOME = np.array([-2.0, 0.2, 0.0, -2.2, 0.0, 2.4, 0.785])
# Middle of the work area, hand down: the rest pose for the redundant joint.
READY = np.array([0.0, 0.0, 0.0, -2.2, 0.0, 2.2, 0.785])

POSITION_TOLERANCE = 0.01
ANGLE_TOLERANCE = 0.05
# Calls of bullet's solver, 20 steps each; near a solution one is enough.
REFINEMENTS = 30


def load_panda(client: Any) -> int:
    """The arm with its gripper, base at the origin: the body's id."""
    # The renderer has its own meshes; loading bullet's would double the start time.
    flags = pybullet.URDF_IGNORE_VISUAL_SHAPES
    return int(client.loadURDF(str(PANDA_URDF), useFixedBase=True, flags=flags))


class Kinematics:
    """Forward and inverse kinematics of the arm, by pybullet's damped least squares."""

    def __init__(self, reach: float = np.inf) -> None:
        """reach: m from the base's axis, beyond which there is no solution."""
        self._client: Any = connect()
        self.reach = reach
        self._arm = load_panda(self._client)
        infos = [self._client.getJointInfo(self._arm, j) for j in ARM_JOINTS + FINGER_JOINTS]
        self._all_lower = [info[8] for info in infos]
        self._all_upper = [info[9] for info in infos]
        self._ranges = [hi - lo for lo, hi in zip(self._all_lower, self._all_upper, strict=True)]
        self.lower = np.array(self._all_lower[:7])
        self.upper = np.array(self._all_upper[:7])
        self.max_velocity = np.array([info[11] for info in infos[:7]])
        self.max_force = np.array([info[10] for info in infos[:7]])

    def forward(self, joints: Vector) -> tuple[Vector, Vector]:
        """Grasp point (m) and its orientation (quaternion xyzw) for seven joint angles (rad)."""
        # One call: each one moves all of the links.
        angles = [[angle] for angle in joints.tolist()]
        self._client.resetJointStatesMultiDof(self._arm, ARM_JOINTS, angles)
        state = self._client.getLinkState(self._arm, GRASP_LINK, computeForwardKinematics=True)
        return np.array(state[4]), np.array(state[5])

    def tool_pose(self, joints: Vector) -> ToolPose:
        """Where the grasp point is and how the hand is turned, whatever its tilt."""
        position, orientation = self.forward(joints)
        axis = np.asarray(pybullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)[:, 0]
        x, y, z = map(float, position)
        return ToolPose(x, y, z, float(np.arctan2(axis[1], axis[0])))

    def inverse(self, pose: ToolPose, seed: Vector) -> Vector:
        """Joint angles (rad) near `seed` that bring the hand to `pose`.

        Raises:
            NoSolutionError: the best joints miss by more than 1 cm or 3 degrees, or break a limit;
                or the pose lies beyond the arm's reach.
        """
        distance = float(np.hypot(pose.x, pose.y))
        if distance > self.reach:
            raise NoSolutionError(
                f'Inverse kinematics found no solution for x {pose.x:.2f}, y {pose.y:.2f}, '
                f'z {pose.z:.2f} m: expected at most {self.reach:.2f} m from the base, '
                f'got {distance:.2f} m.'
            )
        orientation = pybullet.getQuaternionFromEuler((np.pi, 0.0, pose.yaw))
        joints = np.array(seed, dtype=float)
        self.forward(joints)
        for _ in range(REFINEMENTS):
            joints = np.clip(self._refine(pose, orientation, joints), self.lower, self.upper)
            miss, turn = self._residual(pose, orientation, joints)
            if miss < 0.001 and turn < 0.01:
                break
        if miss > POSITION_TOLERANCE or turn > ANGLE_TOLERANCE:
            raise NoSolutionError(
                f'Inverse kinematics found no solution for x {pose.x:.2f}, y {pose.y:.2f}, '
                f'z {pose.z:.2f} m: expected to miss by at most {POSITION_TOLERANCE:.3f} m and '
                f'{ANGLE_TOLERANCE:.2f} rad, got {miss:.3f} m and {turn:.2f} rad.'
            )
        return joints

    def nearest(self, pose: ToolPose, seed: Vector) -> Vector:
        """As `inverse`, at the yaw or turned by pi, whichever turns the wrist less."""
        found = []
        for yaw in (pose.yaw, pose.yaw + np.pi):
            try:
                found.append(self.inverse(pose._replace(yaw=yaw), seed))
            except NoSolutionError as error:
                reason = error
        if not found:
            raise reason
        return min(found, key=lambda joints: abs(float(joints[6] - READY[6])))

    @staticmethod
    def guess(pose: ToolPose) -> Vector:
        """A start for `inverse`: the base turned towards the pose, the rest at READY."""
        return np.array([np.arctan2(pose.y, pose.x), *READY[1:]])

    def _refine(self, pose: ToolPose, orientation: Any, joints: Vector) -> Vector:
        """Joints nearer to the pose than those that the copy of the arm has."""
        solution = self._client.calculateInverseKinematics(
            self._arm,
            GRASP_LINK,
            pose.position.tolist(),
            orientation,
            lowerLimits=self._all_lower,
            upperLimits=self._all_upper,
            jointRanges=self._ranges,
            restPoses=[*joints.tolist(), 0.02, 0.02],
            maxNumIterations=20,
            residualThreshold=1e-5,
        )
        return np.array(solution[:7])

    def _residual(self, pose: ToolPose, orientation: Any, joints: Vector) -> tuple[float, float]:
        position, reached = self.forward(joints)
        cosine = min(1.0, abs(float(np.dot(reached, orientation))))
        return float(np.linalg.norm(position - pose.position)), 2.0 * float(np.arccos(cosine))
