"""Publishes and receives the heartbeats of the cell's nodes."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from likeme_core.heartbeats import HEARTBEAT_PERIOD, HeartbeatMonitor, NodeState
from likeme_core.ros.diagnostics import software_version
from likeme_core.ros.time import steady_clock
from likeme_msgs.msg import Heartbeat

#: A lost heartbeat is not sent again: the next one follows in 50 ms.
HEARTBEAT_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)

Health = tuple[NodeState, str]


class HeartbeatPublisher:
    """Publishes `heartbeat` (Heartbeat, best effort, 20 Hz by the steady clock).

    The timer is served by the node's executor: a callback that does not return stops it.

    Attributes:
        run: id of this run of the process.
        version: of the software.
    """

    def __init__(self, node: Node, health: Callable[[], Health] | None = None) -> None:
        """health: what the node can do and, if it is not READY, why; None: READY."""
        self._node, self._health = node, health
        self.run = uuid.uuid4().hex
        self._sequence = 0
        self.version = software_version()
        self._publisher = node.create_publisher(Heartbeat, 'heartbeat', HEARTBEAT_QOS)
        node.create_timer(HEARTBEAT_PERIOD, self.publish, clock=steady_clock())
        self.publish()

    def publish(self) -> None:
        """Publish a heartbeat now."""
        state, message = (NodeState.READY, '') if self._health is None else self._health()
        self._sequence += 1
        beat = Heartbeat(
            node=self._node.get_fully_qualified_name(), run=self.run, sequence=self._sequence,
            state=int(state), message=message, version=self.version,
        )  # fmt: skip
        beat.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(beat)


class HeartbeatSubscriber:
    """Receives `heartbeat` into a monitor.

    Attributes:
        monitor: what was heard.
    """

    def __init__(self, node: Node) -> None:
        self.monitor = HeartbeatMonitor()
        node.create_subscription(Heartbeat, 'heartbeat', self._on_heartbeat, HEARTBEAT_QOS)

    def _on_heartbeat(self, beat: Heartbeat) -> None:
        self.monitor.hear(
            beat.node, beat.run, time.monotonic(), beat.state, beat.message, beat.version
        )
