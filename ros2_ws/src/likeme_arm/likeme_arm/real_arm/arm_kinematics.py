"""Forward and inverse kinematics of any arm with a URDF, by Pinocchio."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from likeme_arm.real_arm.arm_config import ArmConfig
from likeme_arm.real_arm.urdf_files import package_folders, urdf_path
from likeme_arm.tool_pose import NoSolutionError, ToolPose, Vector

#: Of inverse kinematics: m, rad, steps from one start, starts.
POSITION_TOLERANCE, ANGLE_TOLERANCE = 0.0005, 0.005
STEPS, STARTS = 80, 12
DAMPING = 1e-4
#: Greatest step of a joint, rad: keeps a solution near its start.
LARGEST_STEP = 0.2


class ArmKinematics:
    """The arm's moving joints alone; those of the gripper stand open.

    Attributes:
        model, data: Pinocchio's.
        lower, upper: joint limits of the URDF, rad.
    """

    def __init__(self, config: ArmConfig) -> None:
        """Read the URDF.

        Raises:
            ValueError: it cannot be read, or has no such joint or frame.
        """
        import pinocchio as pin

        self._pin, self.config = pin, config
        path = urdf_path(config.urdf)
        whole = _whole_model(pin, path)
        self.geometry = _geometry(pin, whole, path)
        _check_names(config, whole)
        reference = pin.neutral(whole)
        gripper = config.gripper
        if whole.existJointName(gripper.joint):
            reference[whole.joints[whole.getJointId(gripper.joint)].idx_q] = gripper.positions[0]
        others = [i for i in range(1, whole.njoints) if whole.names[i] not in config.joints]
        self.model, self.geometry = pin.buildReducedModel(whole, self.geometry, others, reference)
        self._order = [self.model.joints[self.model.getJointId(n)].idx_q for n in config.joints]
        self._stand(config.base)
        self.data = self.model.createData()
        self._frame = self.model.getFrameId(config.tool_frame)
        x, y, z, *rpy = config.tool_offset
        self._offset = pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array([x, y, z]))
        self.lower = self.model.lowerPositionLimit[self._order]
        self.upper = self.model.upperPositionLimit[self._order]

    def configuration(self, joints: Vector) -> Vector:
        """Joint angles in the model's order."""
        q = np.empty(self.model.nq)
        q[self._order] = joints
        return q

    def tool_pose(self, joints: Vector) -> ToolPose:
        """Where the grasp point is and how the hand is turned, whatever its tilt."""
        placement = self._placement(joints)
        x, y, z = map(float, placement.translation)
        axis = placement.rotation[:, 0]
        return ToolPose(x, y, z, float(np.arctan2(axis[1], axis[0])))

    def inverse(self, pose: ToolPose, seed: Vector, starts: int = 1) -> Vector:
        """Joint angles (rad) near `seed` that bring the hand to `pose`, pointing down.

        starts: from how many other configurations to search as well.

        Raises:
            NoSolutionError: none was found within the joints' limits.
        """
        goal = self._pin.SE3(self._pin.rpy.rpyToMatrix(np.pi, 0.0, pose.yaw), pose.position)
        rng = np.random.default_rng(0)
        best = np.inf
        for start in range(starts):
            joints = seed if start == 0 else seed + rng.normal(0.0, 0.4, len(seed))
            joints, error = self._descend(goal, np.clip(joints, self.lower, self.upper))
            if _within(error):
                return joints
            best = min(best, float(np.linalg.norm(error[:3])))
        raise NoSolutionError(
            f'Inverse kinematics found no solution for x {pose.x:.2f}, y {pose.y:.2f}, '
            f'z {pose.z:.2f} m, yaw {pose.yaw:.2f} rad: the best misses by {best:.3f} m.'
        )

    def follow(self, pose: ToolPose, before: Vector, largest: float) -> Vector:
        """As `inverse`, from the joints of the pose before on a line.

        Raises:
            NoSolutionError: none was found, or a joint would turn by more than `largest` rad.
        """
        joints = self.inverse(pose, before)
        change = np.abs(joints - before)
        if change.max() > largest:
            name = self.config.joints[int(change.argmax())]
            raise NoSolutionError(
                f'Inverse kinematics found no line near x {pose.x:.2f}, y {pose.y:.2f}, '
                f'z {pose.z:.2f} m: expected {name} to turn by at most {largest:g} rad, '
                f'got {change.max():.2f}.'
            )
        return joints

    def nearest(self, pose: ToolPose) -> Vector:
        """As `inverse`, at the yaw or turned by pi: the solution nearest to `ready`.

        Raises:
            NoSolutionError: neither was found.
        """
        ready, found = self.config.ready, list[Vector]()
        seed = ready.copy()
        bx, by, _, yaw = self.config.base
        turn = np.arctan2(pose.y - by, pose.x - bx) - yaw
        seed[0] = np.clip(ready[0] + turn, self.lower[0], self.upper[0])
        for angle in (pose.yaw, pose.yaw + np.pi):
            try:
                found.append(self.inverse(pose._replace(yaw=angle), seed, STARTS))
            except NoSolutionError as error:
                reason = error
        if not found:
            raise reason
        return min(found, key=lambda joints: float(np.abs(joints - seed).max()))

    def _placement(self, joints: Vector) -> Any:
        self._pin.forwardKinematics(self.model, self.data, self.configuration(joints))
        return self._pin.updateFramePlacement(self.model, self.data, self._frame) * self._offset

    def _descend(self, goal: Any, joints: Vector) -> tuple[Vector, Vector]:
        """Damped least squares within the limits."""
        pin = self._pin
        for _ in range(STEPS):
            here = self._placement(joints)
            error = pin.log6(here.actInv(goal)).vector
            if _within(error):
                break
            whole = pin.computeFrameJacobian(
                self.model, self.data, self.configuration(joints), self._frame, pin.LOCAL
            )
            jacobian = (self._offset.toActionMatrixInverse() @ whole)[:, self._order]
            square = jacobian @ jacobian.T + DAMPING * np.eye(6)
            step = jacobian.T @ np.linalg.solve(square, error)
            step *= min(1.0, LARGEST_STEP / max(float(np.abs(step).max()), 1e-9))
            joints = np.clip(joints + step, self.lower, self.upper)
        return joints, error

    def _stand(self, base: tuple[float, float, float, float]) -> None:
        """Put the URDF's root where the arm stands."""
        pin = self._pin
        x, y, z, yaw = base
        placed = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, yaw), np.array([x, y, z]))
        for joint in range(1, self.model.njoints):
            if self.model.parents[joint] == 0:
                self.model.jointPlacements[joint] = placed * self.model.jointPlacements[joint]
        for frame in self.model.frames:
            if frame.parentJoint == 0:
                frame.placement = placed * frame.placement
        for item in self.geometry.geometryObjects:
            if item.parentJoint == 0:
                item.placement = placed * item.placement


def _within(error: Vector) -> bool:
    distance, turn = np.linalg.norm(error[:3]), np.linalg.norm(error[3:])
    return bool(distance < POSITION_TOLERANCE and turn < ANGLE_TOLERANCE)


def _whole_model(pin: Any, path: Path) -> Any:
    try:
        return pin.buildModelFromUrdf(str(path))
    except (ValueError, RuntimeError) as error:
        raise ValueError(f'{path} cannot be read: {" ".join(str(error).split())}') from None


def _geometry(pin: Any, model: Any, path: Path) -> Any:
    try:
        return pin.buildGeomFromUrdf(
            model, str(path), pin.GeometryType.COLLISION, package_dirs=package_folders(path)
        )
    except (ValueError, RuntimeError) as error:
        raise ValueError(
            f'The meshes of {path} cannot be read: {" ".join(str(error).split())}'
        ) from None


def _check_names(config: ArmConfig, model: Any) -> None:
    for name in config.joints:
        if not model.existJointName(name):
            known = ', '.join(model.names[1:])
            raise ValueError(f"{config.name}: expected joints of {known}, got '{name}'.")
    for name in (config.tool_frame, *config.finger_links):
        if not model.existFrame(name):
            raise ValueError(f"{config.name}: expected a frame of the URDF, got '{name}'.")
