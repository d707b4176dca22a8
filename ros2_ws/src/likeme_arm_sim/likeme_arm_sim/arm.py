"""The simulated arm: joint targets at every physics step, and a gripper."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pybullet

from likeme_arm.tool_pose import NoSolutionError, ToolPose
from likeme_arm_sim.gripper import OPEN_WIDTH, Gripper
from likeme_arm_sim.joint_path import JointPath, trapezoidal_profile
from likeme_arm_sim.kinematics import ARM_JOINTS, HOME, Kinematics, Vector, load_panda
from likeme_arm_sim.physics import GripperPhysics
from likeme_arm_sim.physics_world import TIME_STEP, Pose

BASE_LINK = 'panda_link0'

# Gains of the joints' position control, per step.
GAINS = [0.3] * 7
# Force of the joints' brakes as a multiple of their motors'.
BRAKE = 20.0
# Of a straight line: distance between two solutions of inverse kinematics, m, and m/s^2.
WAYPOINT_SPACING = 0.02
LINE_ACCELERATION = 1.2
# Of a joint motion, rad/s^2.
JOINT_ACCELERATION = 6.0


class ArmLink(NamedTuple):
    """A link of the URDF, the link that carries it, and whether no joint moves it."""

    name: str
    parent: str
    fixed: bool


class Arm:
    """A Panda in the world's client. Every motion calls `tick` once per physics step.

    Attributes:
        links: all but the base, in bullet's order.
        phase: what the arm does or did last, in a word or two.
    """

    def __init__(
        self,
        client: Any,
        kinematics: Kinematics,
        tick: Callable[[], None],
        speed: float = 1.0,
        gripper: GripperPhysics | None = None,
    ) -> None:
        self._client, self._kinematics, self._tick = client, kinematics, tick
        self.speed, self.phase = speed, 'rest'
        # Jump over motion through free space, which touches nothing: for fast trials.
        self.skip_free_space = False
        self.body = load_panda(client)
        self.links = _links(client, self.body)
        self._link_indices = list(range(len(self.links)))
        self._forces = kinematics.max_force.tolist()
        self._gripper = Gripper(client, self.body, gripper or GripperPhysics())
        self.reset()

    def reset(self) -> None:
        """Put the arm at home with an open gripper: for setting up the table only."""
        self._gripper.reset()
        self._jump(HOME)
        self._gripper.command(OPEN_WIDTH)

    @property
    def joints(self) -> Vector:
        """The seven measured joint angles, rad."""
        states = self._client.getJointStates(self.body, ARM_JOINTS)
        return np.array([state[0] for state in states])

    @property
    def joint_velocities(self) -> Vector:
        """The seven measured joint velocities, rad/s."""
        states = self._client.getJointStates(self.body, ARM_JOINTS)
        return np.array([state[1] for state in states])

    @property
    def fingers(self) -> tuple[float, float]:
        """Distance of each finger from the middle, m."""
        return self._gripper.fingers

    @property
    def at_home(self) -> bool:
        """Whether the arm is at home, out of the camera's view of the table."""
        return bool(np.abs(self.joints - HOME).max() < 0.02)

    def link_poses(self) -> dict[str, Pose]:
        """Poses of the links' URDF frames by link name."""
        states = self._client.getLinkStates(
            self.body, self._link_indices, computeForwardKinematics=True
        )
        poses = {BASE_LINK: Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))}
        for link, state in zip(self.links, states, strict=True):
            poses[link.name] = Pose(np.array(state[4]), np.array(state[5]))
        return poses

    @property
    def tool(self) -> ToolPose:
        """Where the grasp point is now."""
        return self._kinematics.tool_pose(self.joints)

    def halt(self) -> None:
        """Stop within this control step: hold the present joint angles at zero velocity."""
        self._command(self.joints, np.zeros(7), BRAKE)

    def move_home(self) -> None:
        """Move to the home pose, where the arm does not occlude the table."""
        self.phase = 'return home'
        self._move_joints(HOME)

    def reach(self, pose: ToolPose) -> None:
        """Move the joints the shortest way to a pose; raises NoSolutionError before moving."""
        self.phase = 'reach'
        self._move_joints(self._kinematics.nearest(pose, self._kinematics.guess(pose)))

    def reachable(self, pose: ToolPose) -> bool:
        """Whether inverse kinematics finds a solution for a pose."""
        try:
            self._kinematics.nearest(pose, self._kinematics.guess(pose))
        except NoSolutionError:
            return False
        return True

    def move_to(
        self,
        pose: ToolPose,
        speed: float,
        until: Callable[[], bool] | None = None,
        free: float = 0.0,
    ) -> bool:
        """Move in a straight line at `speed` m/s; stop early once `until` holds, and return True.

        The first `free` m of the line touch nothing; with skip_free_space the arm jumps there.

        Raises:
            NoSolutionError: the line leaves the arm's reach; the arm has gone as far as it can.
        """
        self.phase = self._line_phase(pose)
        path = self._line(pose)
        if self.skip_free_space and free > 0.0 and path.failure is None:
            path = path.after(free)
            self._jump(path.joints[0])
        limit = path.greatest_speed(0.9 * self._kinematics.max_velocity)
        limited = min(speed * self.speed, limit)
        stopped = self._follow(
            path, trapezoidal_profile(path.distance[-1], limited, LINE_ACCELERATION), until
        )
        if path.failure is not None and not stopped:
            raise path.failure
        return stopped

    def open_gripper(self, width: float = OPEN_WIDTH) -> None:
        """Open the fingers to `width` m; with skip_free_space, do not wait if they are open."""
        self.phase = 'open gripper'
        self._gripper.command(width)
        if not (self.skip_free_space and self._gripper.at_goal):
            self.wait(0.25)

    def close_gripper(self) -> float:
        """Close the fingers until they stop; returns the width between them, m."""
        self.phase = 'close gripper'
        self._gripper.command(0.0)
        self.wait(0.5)
        return self._gripper.width

    def holding(self) -> bool:
        """Whether something keeps the closed fingers apart."""
        return self._gripper.holding

    def wait(self, seconds: float) -> None:
        """Do nothing for a time."""
        for _ in range(round(seconds / TIME_STEP)):
            self._tick()

    def _line_phase(self, goal: ToolPose) -> str:
        x, y, z = goal.position - self.tool.position
        if abs(z) > np.hypot(x, y):
            return 'lift' if z > 0 else 'lower'
        return 'carry' if self.holding() else 'slide'

    def _move_joints(self, goal: Vector) -> None:
        if self.skip_free_space:
            self._jump(goal)
            return
        start = self.joints
        change = goal - start
        limits = 0.85 * self._kinematics.max_velocity * self.speed
        # The joint that needs longest sets the speed; distance is its travel.
        slowest = int(np.argmax(np.abs(change) / limits))
        length = abs(float(change[slowest]))
        path = JointPath(np.array([0.0, max(length, 1e-6)]), np.array([start, goal]))
        steps = trapezoidal_profile(
            length, float(limits[slowest]), JOINT_ACCELERATION * self.speed
        )
        self._follow(path, steps, None)

    def _jump(self, joints: Vector) -> None:
        for joint, angle in zip(ARM_JOINTS, joints, strict=True):
            self._client.resetJointState(self.body, joint, float(angle))
        self._command(joints, np.zeros(7))

    def _line(self, goal: ToolPose) -> JointPath:
        start, joints = self.tool, self.joints
        turn = (goal.yaw - start.yaw + np.pi) % (2 * np.pi) - np.pi
        length = float(np.linalg.norm(goal.position - start.position))
        count = max(2, int(np.ceil(max(length / WAYPOINT_SPACING, abs(turn) / 0.1))))
        waypoints, found, failure = [joints], [0.0], None
        for fraction in np.linspace(0.0, 1.0, count + 1)[1:]:
            position = start.position + fraction * (goal.position - start.position)
            try:
                x, y, z = map(float, position)
                pose = ToolPose(x, y, z, start.yaw + fraction * turn)
                waypoints.append(self._kinematics.inverse(pose, waypoints[-1]))
            except NoSolutionError as error:
                failure = error
                break
            found.append(fraction * max(length, 0.05))
        if len(waypoints) == 1:
            raise failure or NoSolutionError('Expected a line of some length, got none.')
        return JointPath(np.array(found), np.array(waypoints), failure)

    def _follow(self, path: JointPath, steps: Vector, until: Callable[[], bool] | None) -> bool:
        targets = path.at(steps)
        velocities = np.gradient(targets, TIME_STEP, axis=0) if len(targets) > 1 else targets * 0
        commands = zip(targets.tolist(), velocities.tolist(), strict=True)
        for index, (target, velocity) in enumerate(commands):
            self._stream(target, velocity, self._forces)
            self._tick()
            if until is not None and index % 8 == 0 and until():
                self._command(self.joints, np.zeros(7))
                return True
        self._command(targets[-1], np.zeros(7))
        return False

    def _command(self, target: Vector, velocity: Vector, strength: float = 1.0) -> None:
        forces = (strength * self._kinematics.max_force).tolist()
        self._stream(target.tolist(), velocity.tolist(), forces)

    def _stream(self, target: list[float], velocity: list[float], forces: list[float]) -> None:
        # Called at every step: plain lists, without the client's wrapper, for speed.
        pybullet.setJointMotorControlArray(
            self.body,
            ARM_JOINTS,
            pybullet.POSITION_CONTROL,
            targetPositions=target,
            targetVelocities=velocity,
            forces=forces,
            positionGains=GAINS,
            physicsClientId=self._client._client,
        )


def _links(client: Any, body: int) -> tuple[ArmLink, ...]:
    infos = [client.getJointInfo(body, joint) for joint in range(client.getNumJoints(body))]
    names = [info[12].decode() for info in infos]
    return tuple(
        ArmLink(
            name, BASE_LINK if info[16] < 0 else names[info[16]], info[2] == client.JOINT_FIXED
        )
        for name, info in zip(names, infos, strict=True)
    )
