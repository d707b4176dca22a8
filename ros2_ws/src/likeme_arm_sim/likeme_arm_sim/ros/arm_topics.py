"""Topics of the simulated arm: joint states out, the table state in."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from rclpy.node import Node
from sensor_msgs.msg import JointState

from likeme_arm.ros.table_state_topic import TableStateTopic
from likeme_arm_sim import messages
from likeme_arm_sim.simulation_driver import SimulationDriver


class ArmTopics:
    """Publishes `joint_states` and keeps the objects of `table_state`."""

    def __init__(self, node: Node, driver: SimulationDriver) -> None:
        self._arm = driver.cell.arm
        self._joints = node.create_publisher(JointState, 'joint_states', 10)
        self._table = TableStateTopic(node, driver)

    @property
    def dropped(self) -> int:
        """Number of table states that could not be used."""
        return self._table.dropped

    def publish(self, stamp: Time) -> None:
        """Publish the present joint state."""
        self._joints.publish(messages.joint_state_message(self._arm, stamp))
