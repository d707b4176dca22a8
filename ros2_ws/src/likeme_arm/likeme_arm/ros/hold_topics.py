"""Brings the hold from its topics into a driver's HoldMonitor."""

from __future__ import annotations

import time
from typing import Any

from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from likeme_arm.hold_monitor import HoldMonitor
from likeme_core.ros.qos import LATCHED
from likeme_core.ros.time import steady_clock
from likeme_core.stamps import SECOND
from likeme_msgs.msg import HoldState

#: s between two requests to a keeper that has not taken a stop over yet.
REPEAT_PERIOD = 0.2


class HoldTopics:
    """Subscribes cell/hold_state and cell/stop; calls cell/hold if the keeper missed a stop."""

    def __init__(self, node: Node, monitor: HoldMonitor) -> None:
        self._monitor = monitor
        self._keeper = node.create_client(Trigger, 'cell/hold')
        # rclpy inspects the signature, and is annotated for callbacks with one parameter.
        node.create_subscription(
            HoldState, 'cell/hold_state', self._on_state, LATCHED,  # type: ignore[arg-type]
        )  # fmt: skip
        node.create_subscription(String, 'cell/stop', self._on_stop, 10)
        node.create_timer(REPEAT_PERIOD, self._pass_on, clock=steady_clock())

    def _on_state(self, message: HoldState, info: dict[str, Any]) -> None:
        arrived = int(info.get('received_timestamp') or 0)
        age = max(0, time.time_ns() - arrived) / SECOND if arrived else 0.0
        self._monitor.hear(message.held, message.change, age)

    def _on_stop(self, _: String) -> None:
        self._monitor.stop()

    def _pass_on(self) -> None:
        if self._monitor.unconfirmed and self._keeper.service_is_ready():
            self._keeper.call_async(Trigger.Request())
