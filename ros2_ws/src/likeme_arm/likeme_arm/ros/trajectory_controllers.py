"""Joint trajectory controllers of ros2_control: by their action, or by their topic."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

from builtin_interfaces.msg import Duration
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from likeme_arm.real_arm.arm_config import ArmConfig
from likeme_arm.real_arm.motion_fault import MotionFaultError
from likeme_arm.real_arm.robot import TrajectoryController
from likeme_arm.real_arm.trajectory import Trajectory

CONTROL_MSGS = 'control_msgs'


def create_trajectory_controller(
    node: Node, config: ArmConfig, interface: str
) -> TrajectoryController:
    """The controller of an arm.

    Args:
        node: whose executor serves it.
        config: of the arm.
        interface: 'action', 'topic', or 'auto': the action where control_msgs is installed.

    Raises:
        ValueError: 'action' without control_msgs.
    """
    there = find_spec(CONTROL_MSGS) is not None
    if interface == 'action' and not there:
        raise ValueError('Expected control_msgs for controller_interface action, found none.')
    if interface == 'topic' or not there:
        return TopicController(node, config)
    return ActionController(node, config)


def trajectory_message(trajectory: Trajectory, config: ArmConfig) -> JointTrajectory:
    """Its points from the last one on at which it rests at its begin.

    The stamp is 0: the controller starts when the message arrives, from where the arm is then.
    With another one it would have the arm at once where it is due by the stamp.
    """
    message = JointTrajectory(joint_names=list(config.joints))
    first = trajectory.last_rest
    for time, joints, velocities, accelerations in zip(
        trajectory.time[first:], trajectory.joints[first:], trajectory.velocities[first:],
        trajectory.accelerations[first:], strict=True,
    ):  # fmt: skip
        point = JointTrajectoryPoint(
            positions=joints.tolist(),
            velocities=velocities.tolist(),
            accelerations=accelerations.tolist(),
        )
        seconds, rest = divmod(round(float(time) * 1e9), 10**9)
        point.time_from_start = Duration(sec=seconds, nanosec=rest)
        message.points.append(point)
    return message


def braking_message(braking: Trajectory, config: ArmConfig) -> JointTrajectory:
    """The last point alone, without accelerations: controllers get there by cubics."""
    message = trajectory_message(braking, config)
    message.points = message.points[-1:]
    message.points[0].accelerations = []
    return message


class TopicController:
    """Publishes `CONTROLLER/joint_trajectory`; the controller tells nothing back."""

    def __init__(self, node: Node, config: ArmConfig) -> None:
        self._config = config
        self._publisher = node.create_publisher(
            JointTrajectory, f'{config.controller}/joint_trajectory', 1
        )

    @property
    def failure(self) -> str | None:
        """Always None: what went wrong shows in joint_states."""
        return None

    def send(self, trajectory: Trajectory) -> None:
        """Begin a trajectory now."""
        if not self._publisher.get_subscription_count():
            raise MotionFaultError(
                f'Expected a controller at {self._publisher.topic_name}, found none.'
            )
        self._publisher.publish(trajectory_message(trajectory, self._config))

    def stop(self, braking: Trajectory | None) -> None:
        """Replace the trajectory by one that brakes on the same path."""
        if braking is not None:
            self._publisher.publish(braking_message(braking, self._config))


class ActionController:
    """Sends goals to `CONTROLLER/follow_joint_trajectory` and cancels them."""

    def __init__(self, node: Node, config: ArmConfig) -> None:
        from control_msgs.action import FollowJointTrajectory

        self._type, self._config = FollowJointTrajectory, config
        self._name = f'{config.controller}/follow_joint_trajectory'
        self._client = ActionClient(node, FollowJointTrajectory, self._name)
        self._goal = 0
        self._handle: Any = None
        self._stopped = False
        self._failure: str | None = None

    @property
    def failure(self) -> str | None:
        """Why the controller ended the goal, or did not accept it."""
        return self._failure

    def send(self, trajectory: Trajectory) -> None:
        """Send a goal."""
        if not self._client.server_is_ready():
            raise MotionFaultError(f'Expected a controller at {self._name}, found none.')
        self._goal += 1
        self._handle, self._failure, self._stopped = None, None, False
        goal, number = self._type.Goal(), self._goal
        goal.trajectory = trajectory_message(trajectory, self._config)
        future = self._client.send_goal_async(goal)
        future.add_done_callback(lambda done: self._on_answer(done, number))

    def stop(self, braking: Trajectory | None) -> None:
        """Cancel the goal, now or as soon as it is accepted; the controller holds its position."""
        self._stopped = True
        if self._handle is not None:
            self._handle.cancel_goal_async()

    def _on_answer(self, done: Future, number: int) -> None:
        handle = done.result()
        if not handle.accepted:
            if number == self._goal:
                self._failure = f'{self._name} refused the trajectory.'
            return
        if number != self._goal or self._stopped:
            handle.cancel_goal_async()
            return
        self._handle = handle
        handle.get_result_async().add_done_callback(lambda d: self._on_result(d, number))

    def _on_result(self, done: Future, number: int) -> None:
        result = done.result().result
        if number != self._goal or self._stopped:
            return
        if result.error_code != self._type.Result.SUCCESSFUL:
            why = result.error_string or f'error code {result.error_code}'
            self._failure = f'{self._name} ended the trajectory: {why}.'
