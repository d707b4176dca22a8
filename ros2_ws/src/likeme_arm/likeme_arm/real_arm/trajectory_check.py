"""What a trajectory must hold to before it is sent: limits, work space, collisions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from likeme_arm.motion import UnsafeMotionError
from likeme_arm.real_arm.arm_collisions import ArmCollisions, Obstacle
from likeme_arm.real_arm.arm_config import ArmConfig
from likeme_arm.real_arm.arm_kinematics import ArmKinematics
from likeme_arm.real_arm.trajectory import Trajectory
from likeme_arm.tool_pose import Vector
from likeme_core.world import World

#: Greatest step of a joint between two configurations that are checked for collisions, rad.
COLLISION_STEP = 0.04
#: Of positions and times, against rounding.
ROUNDING = 1e-6
AXES = 'xyz'


class TrajectoryCheck:
    """Checks trajectories of one arm at one table; computed apart from what planned them."""

    def __init__(
        self, config: ArmConfig, kinematics: ArmKinematics, collisions: ArmCollisions, world: World
    ) -> None:
        self._config, self._kinematics, self._collisions = config, kinematics, collisions
        self._low, self._high = np.array(config.workspace).T.copy()
        top, reach = world.table.top, config.person_reach
        for side in world.person_sides:
            if side == 'far':
                self._high[0] = min(self._high[0], top.x_max + reach)
            elif side == 'near':
                self._low[0] = max(self._low[0], top.x_min - reach)
            elif side == 'left':
                self._high[1] = min(self._high[1], top.y_max + reach)
            else:
                self._low[1] = max(self._low[1], top.y_min - reach)

    def check(self, trajectory: Trajectory, start: Vector, obstacles: Sequence[Obstacle]) -> None:
        """Check a trajectory that begins at the measured joint angles `start`.

        Raises:
            UnsafeMotionError: what it would break, expected and got.
        """
        self._check_start(trajectory, start)
        self._check_limits(trajectory)
        for joints in _sparse(trajectory.joints):
            self._check_place(joints)
            problem = self._collisions.problem(joints, obstacles)
            if problem is not None:
                raise UnsafeMotionError(f'On the way {problem}.')

    def _check_start(self, trajectory: Trajectory, start: Vector) -> None:
        apart = np.abs(trajectory.joints[0] - start)
        worst = int(apart.argmax())
        if apart[worst] > self._config.tolerances.tracking:
            raise UnsafeMotionError(
                f'Expected a trajectory from where the arm is, got {self._config.joints[worst]} '
                f'{apart[worst]:.2f} rad apart.'
            )

    def _check_limits(self, trajectory: Trajectory) -> None:
        kinematics, config = self._kinematics, self._config
        joints = trajectory.joints
        low, high = kinematics.lower - joints, joints - kinematics.upper
        excess = np.maximum(low, high).max(0)
        worst = int(excess.argmax())
        if excess[worst] > ROUNDING or not np.isfinite(joints).all():
            raise UnsafeMotionError(
                f'Expected {config.joints[worst]} within {kinematics.lower[worst]:.2f} and '
                f'{kinematics.upper[worst]:.2f} rad, got {excess[worst]:.3f} rad beyond.'
            )
        # From the points themselves, as the controller interpolates them.
        step = np.diff(trajectory.time)[:, None]
        change = np.abs(np.diff(joints, axis=0) / step)
        for what, unit, values, limits in (
            ('speed', 'rad/s', np.abs(trajectory.velocities), config.max_velocity),
            ('speed', 'rad/s', change, config.max_velocity),
            ('acceleration', 'rad/s^2', np.abs(trajectory.accelerations), config.max_acceleration),
        ):
            share = (values / limits).max(0)
            worst = int(share.argmax())
            if not share[worst] <= 1.0 + ROUNDING:
                raise UnsafeMotionError(
                    f'Expected a {what} of {config.joints[worst]} of at most '
                    f'{limits[worst]:.2f} {unit}, got {values[:, worst].max():.2f}.'
                )

    def _check_place(self, joints: Vector) -> None:
        low, high = self._collisions.extent(joints)
        for axis, name in enumerate(AXES):
            if low[axis] < self._low[axis] or high[axis] > self._high[axis]:
                raise UnsafeMotionError(
                    f'Expected the arm within {name} {self._low[axis]:.3f} to '
                    f'{self._high[axis]:.3f} m, got {low[axis]:.3f} to {high[axis]:.3f} m.'
                )


def _sparse(joints: Vector) -> list[Vector]:
    """Of the points, those that lie apart, with more where two lie too far apart."""
    kept = [joints[0]]
    for each in joints[1:]:
        step = float(np.abs(each - kept[-1]).max())
        if step >= COLLISION_STEP:
            count = int(np.ceil(step / COLLISION_STEP))
            before = kept[-1]
            kept += [before + (each - before) * (i / count) for i in range(1, count + 1)]
    if np.abs(kept[-1] - joints[-1]).max() > 0:
        kept.append(joints[-1])
    return kept
