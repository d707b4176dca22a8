"""Brings the table state into a driver."""

from __future__ import annotations

from rclpy.node import Node

from likeme_arm import messages
from likeme_arm.motion import ObjectView
from likeme_arm.motion_driver import MotionDriver
from likeme_core.ros.qos import OVERRIDABLE
from likeme_core.ros.time import stamp_ns
from likeme_msgs.msg import TableState

#: s between warnings about table states that cannot be used.
WARNING_PERIOD = 5.0


class TableStateTopic:
    """Subscribes `table_state` and keeps its objects in `MotionDriver.perceived`.

    Attributes:
        dropped: number of table states that could not be used.
    """

    def __init__(self, node: Node, driver: MotionDriver) -> None:
        self._driver, self._logger = driver, node.get_logger()
        self.dropped = 0
        self._unknown: dict[str, ObjectView] = {}
        node.create_subscription(
            TableState, 'table_state', self._on_table_state, 1, qos_overriding_options=OVERRIDABLE
        )

    def _on_table_state(self, message: TableState) -> None:
        try:
            views = messages.object_views(message, self._driver.world)
            stamp = stamp_ns(message.header.stamp)
            if not message.arm_in_view:
                # The arm hides what it stands over.
                self._unknown = messages.unknown_views(message)
            self._driver.perceived.update(stamp, views | self._unknown, self._driver.now)
        except ValueError as error:
            self.dropped += 1
            self._logger.warning(str(error), throttle_duration_sec=WARNING_PERIOD)
