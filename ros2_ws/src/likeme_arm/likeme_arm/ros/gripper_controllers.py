"""Controllers of a gripper: a position controller's topic, or the action GripperCommand."""

from __future__ import annotations

from importlib.util import find_spec

from rclpy.action import ActionClient
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray

from likeme_arm.real_arm.arm_config import GripperConfig
from likeme_arm.real_arm.motion_fault import MotionFaultError
from likeme_arm.real_arm.robot import GripperController


def create_gripper_controller(node: Node, config: GripperConfig) -> GripperController:
    """The controller that a configuration names.

    Raises:
        ValueError: gripper_command without control_msgs.
    """
    if config.kind == 'commands':
        return CommandsController(node, config)
    if find_spec('control_msgs') is None:
        raise ValueError('Expected control_msgs for a gripper_command, found none.')
    return GripperCommandController(node, config)


class CommandsController:
    """Publishes the position (Float64MultiArray), as forward and position controllers take it."""

    def __init__(self, node: Node, config: GripperConfig) -> None:
        self._publisher = node.create_publisher(Float64MultiArray, config.name, 1)

    def command(self, position: float) -> None:
        """Move the joint to a position."""
        if not self._publisher.get_subscription_count():
            raise MotionFaultError(
                f'Expected a gripper at {self._publisher.topic_name}, found none.'
            )
        self._publisher.publish(Float64MultiArray(data=[position]))


class GripperCommandController:
    """Sends goals to the action; where the fingers come to rest is read from joint_states."""

    def __init__(self, node: Node, config: GripperConfig) -> None:
        from control_msgs.action import GripperCommand

        self._type, self._config = GripperCommand, config
        self._client = ActionClient(node, GripperCommand, config.name)

    def command(self, position: float) -> None:
        """Move the joint to a position."""
        if not self._client.server_is_ready():
            raise MotionFaultError(f'Expected a gripper at {self._config.name}, found none.')
        goal = self._type.Goal()
        goal.command.position, goal.command.max_effort = position, self._config.max_effort
        self._client.send_goal_async(goal)
