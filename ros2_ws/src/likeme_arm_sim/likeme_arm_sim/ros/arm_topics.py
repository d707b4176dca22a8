"""Topics of the simulated arm: joint states out, the table state in."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from rclpy.node import Node
from sensor_msgs.msg import JointState

from likeme_arm_sim import messages
from likeme_arm_sim.simulation_driver import SimulationDriver
from likeme_core.ros.qos import OVERRIDABLE
from likeme_core.ros.time import stamp_ns
from likeme_msgs.msg import TableState

#: s between warnings about table states that cannot be used.
WARNING_PERIOD = 5.0


class ArmTopics:
    """Publishes `joint_states` and keeps the objects of `table_state`.

    Attributes:
        dropped: number of table states that could not be used.
    """

    def __init__(self, node: Node, driver: SimulationDriver) -> None:
        self._world, self._arm, self._driver = driver.cell.world, driver.cell.arm, driver
        self._logger = node.get_logger()
        self.dropped = 0
        self._joints = node.create_publisher(JointState, 'joint_states', 10)
        node.create_subscription(
            TableState, 'table_state', self._on_table_state, 1, qos_overriding_options=OVERRIDABLE
        )

    def publish(self, stamp: Time) -> None:
        """Publish the present joint state."""
        self._joints.publish(messages.joint_state_message(self._arm, stamp))

    def _on_table_state(self, message: TableState) -> None:
        try:
            views = messages.object_views(message, self._world)
            stamp = stamp_ns(message.header.stamp)
            self._driver.perceived.update(stamp, views, self._driver.now)
        except ValueError as error:
            self.dropped += 1
            self._logger.warning(str(error), throttle_duration_sec=WARNING_PERIOD)
