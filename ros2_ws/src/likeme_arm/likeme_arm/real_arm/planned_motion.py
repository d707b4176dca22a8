"""The motions of the primitives, planned, checked and then carried out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from likeme_arm.real_arm.arm_collisions import Obstacle
from likeme_arm.real_arm.arm_kinematics import ArmKinematics
from likeme_arm.real_arm.robot import DryRobot, Robot
from likeme_arm.real_arm.trajectory import JointPath, Trajectory, joint_path, timed
from likeme_arm.real_arm.trajectory_check import TrajectoryCheck
from likeme_arm.tool_pose import NoSolutionError, ToolPose, Vector

#: Of a straight line: distance between two solutions of inverse kinematics, m and rad.
WAYPOINT_SPACING, WAYPOINT_TURN = 0.02, 0.1
#: Greatest change of a joint between two of them, rad: else the arm would change its posture.
LARGEST_CHANGE = 0.5
#: Speed of a turn without a way, as m of way a rad.
TURN_LENGTH = 0.1
#: Distance of each joint from home at which the arm is there, rad.
AT_HOME = 0.05

#: Told of each checked trajectory with what it is for and the tool's way (N, 3); False: the person
#: who was asked does not want it.
Announce = Callable[[str, Trajectory, Vector], bool]


class NotAllowedError(Exception):
    """A person did not allow a motion, or was not asked to the end."""


class PlannedMotion:
    """`Motion` of an arm with a trajectory controller.

    Attributes:
        phase: what the arm does or did last, in a word or two.
    """

    def __init__(
        self,
        kinematics: ArmKinematics,
        check: TrajectoryCheck,
        robot: Robot | DryRobot,
        obstacles: Callable[[], Sequence[Obstacle]],
        announce: Announce,
    ) -> None:
        """obstacles: what the camera sees, but for the object that is acted on."""
        self._kinematics, self._check, self._robot = kinematics, check, robot
        self._obstacles, self._announce = obstacles, announce
        self._config, self.phase = kinematics.config, 'rest'

    @property
    def tool(self) -> ToolPose:
        """Where the grasp point is now."""
        return self._kinematics.tool_pose(self._robot.joints)

    @property
    def at_home(self) -> bool:
        """Whether the arm is at home."""
        return bool(np.abs(self._robot.joints - self._config.home).max() < AT_HOME)

    def reach(self, pose: ToolPose) -> None:
        """Move the joints the shortest way to a pose."""
        self.phase = 'reach'
        self._go(joint_path(self._robot.joints, self._kinematics.nearest(pose)))

    def reachable(self, pose: ToolPose) -> bool:
        """Whether inverse kinematics finds a solution for a pose."""
        try:
            self._kinematics.nearest(pose)
        except NoSolutionError:
            return False
        return True

    def move_home(self) -> None:
        """Move the joints home."""
        self.phase = 'return home'
        self._go(joint_path(self._robot.joints, self._config.home))

    def move_to(
        self,
        pose: ToolPose,
        speed: float,
        until: Callable[[], bool] | None = None,
        free: float = 0.0,
    ) -> bool:
        """Move in a straight line at `speed` m/s; whether `until` stopped it.

        Raises:
            NoSolutionError: the line leaves the arm's reach; nothing was begun.
        """
        self.phase = self._line_phase(pose)
        path = self._line(pose)
        return path is not None and self._go(path, speed * self._config.speed, until)

    def open_gripper(self, width: float = 0.08) -> None:
        """Open the fingers to `width` m."""
        self.phase = 'open gripper'
        self._robot.set_gripper(width, closed=False)

    def close_gripper(self) -> float:
        """Close the fingers until they stop; the width between them, m."""
        self.phase = 'close gripper'
        return self._robot.set_gripper(0.0, closed=True)

    def holding(self) -> bool:
        """Whether something keeps the closed fingers apart."""
        return self._robot.holding()

    def _go(
        self, path: JointPath, speed: float = np.inf, until: Callable[[], bool] | None = None
    ) -> bool:
        config = self._config
        trajectory = timed(
            path, config.max_velocity, config.max_acceleration, config.max_jerk, speed
        ).after(config.lead)
        self._check.check(trajectory, self._robot.joints, self._obstacles())
        way = np.array([self._kinematics.tool_pose(q).position for q in trajectory.joints[::5]])
        if not self._announce(self.phase, trajectory, way):
            raise NotAllowedError
        return self._robot.follow(trajectory, until)

    def _line(self, goal: ToolPose) -> JointPath | None:
        """The line in joint space; None: the arm is there."""
        joints = self._robot.joints
        start = self._kinematics.tool_pose(joints)
        turn = (goal.yaw - start.yaw + np.pi) % (2 * np.pi) - np.pi
        length = float(np.linalg.norm(goal.position - start.position))
        whole = max(length, TURN_LENGTH * abs(turn))
        if whole < 1e-4:
            return None
        count = max(2, int(np.ceil(max(length / WAYPOINT_SPACING, abs(turn) / WAYPOINT_TURN))))
        waypoints = [joints]
        for fraction in np.linspace(0.0, 1.0, count + 1)[1:]:
            x, y, z = map(float, start.position + fraction * (goal.position - start.position))
            pose = ToolPose(x, y, z, start.yaw + fraction * turn)
            waypoints.append(self._kinematics.follow(pose, waypoints[-1], LARGEST_CHANGE))
        return JointPath(np.linspace(0.0, whole, count + 1), np.array(waypoints))

    def _line_phase(self, goal: ToolPose) -> str:
        x, y, z = goal.position - self.tool.position
        if abs(z) > np.hypot(x, y):
            return 'lift' if z > 0 else 'lower'
        return 'carry' if self.holding() else 'slide'
