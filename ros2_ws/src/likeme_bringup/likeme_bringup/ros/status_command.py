"""`cell status`: what the cell says of itself, watched for about a second.

Exit codes: 0 all nodes are ready and motion is allowed, 1 not so, 2 wrong usage, 3 no cell.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Annotated, Any

import rclpy
import typer
from rclpy.node import Node

from likeme_bringup.cell_status import (
    EXPECTED,
    CellStatus,
    MotionPermission,
    Question,
    node_statuses,
)
from likeme_bringup.ros.service_client import DISCOVERY_TIMEOUT, client_node, domain_of
from likeme_core.cli import Domain, Network
from likeme_core.heartbeats import HEARTBEAT_TIMEOUT, HOLD_TIMEOUT
from likeme_core.ros.heartbeat import HeartbeatSubscriber
from likeme_core.ros.qos import LATCHED
from likeme_msgs.msg import HoldState
from likeme_msgs.srv import AskHuman

#: s to wait for the other nodes once one is heard, and to watch them then.
OTHERS_TIMEOUT, WATCH = 2.0, 1.0


class StatusWatcher:
    """Hears heartbeats and the hold state, and asks for the open questions once."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._monitor = HeartbeatSubscriber(node).monitor
        self._hold: HoldState | None = None
        self._hold_heard = 0.0
        self._asked: Any = None
        self._client = node.create_client(AskHuman, 'ask_human')
        node.create_subscription(HoldState, 'cell/hold_state', self._on_hold, LATCHED)

    def watch(self) -> CellStatus | None:
        """The cell as it is after a while; None if there is none."""
        if not self._spin(DISCOVERY_TIMEOUT, lambda: bool(self._monitor.nodes)):
            return None
        self._spin(OTHERS_TIMEOUT, self._all_heard)
        self._spin(WATCH, lambda: False)
        now, nodes = time.monotonic(), self._monitor.nodes
        silence = {name: self._monitor.silence(name, now) for name in nodes}
        statuses = node_statuses(nodes, silence, HEARTBEAT_TIMEOUT)
        return CellStatus(self._motion(now), statuses, self._questions())

    def _spin(self, timeout: float, done: Callable[[], bool]) -> bool:
        deadline = time.monotonic() + timeout
        while not done() and time.monotonic() < deadline:
            rclpy.spin_once(self._node, timeout_sec=0.02)
            if self._asked is None and self._client.service_is_ready():
                request = AskHuman.Request(command=AskHuman.Request.LIST)
                self._asked = self._client.call_async(request)
        return done()

    def _all_heard(self) -> bool:
        heard = {name.rpartition('/')[2] for name in self._monitor.nodes}
        return heard.issuperset(EXPECTED)

    def _on_hold(self, state: HoldState) -> None:
        self._hold, self._hold_heard = state, time.monotonic()

    def _motion(self, now: float) -> MotionPermission:
        if self._hold is None or now - self._hold_heard > HOLD_TIMEOUT:
            return MotionPermission(False, 'stopped: the hold keeper is not heard')
        if not self._hold.held:
            return MotionPermission(True)
        by = f' by {self._hold.by}' if self._hold.by else ''
        reason = f': {self._hold.reason}' if self._hold.reason else ''
        return MotionPermission(False, f'held{by}{reason}')

    def _questions(self) -> tuple[Question, ...] | None:
        if self._asked is None or not self._asked.done():
            return None
        return tuple(
            Question(int(item.id), item.object, item.question)
            for item in self._asked.result().pending
        )


def status_command(
    as_json: Annotated[bool, typer.Option('--json', help='One JSON document.')] = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Print the state of the cell in one line; exit code 0: all is ready and may move."""
    with client_node(network, domain) as node:
        status = StatusWatcher(node).watch()
        number = domain_of(node)
    if status is None:
        print(f'No node is heard on ROS domain {number}: is the cell running?', file=sys.stderr)
        raise typer.Exit(3)
    print(json.dumps(status.as_json(), indent=2) if as_json else status.line)
    raise typer.Exit(0 if status.in_service else 1)
