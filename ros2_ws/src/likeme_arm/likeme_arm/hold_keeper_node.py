"""The hold keeper: holds all motion of a cell until a person resumes it, across restarts."""

from __future__ import annotations

import fcntl
import sys
import time
from pathlib import Path
from typing import BinaryIO

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from likeme_arm.hold_latch import HISTORY, HoldChange, HoldLatch
from likeme_core.heartbeats import NodeState
from likeme_core.ros.diagnostics import DiagnosticsPublisher, diagnostics_msg
from likeme_core.ros.heartbeat import HeartbeatPublisher
from likeme_core.ros.other_servers import other_servers
from likeme_core.ros.qos import LATCHED, kept
from likeme_core.ros.spin import join_graph, run_node
from likeme_core.ros.state_folder import state_folder_of
from likeme_core.ros.time import steady_clock
from likeme_msgs.msg import HoldState

#: s between two messages of the state, also while nothing changes.
STATE_PERIOD = 0.05
RESUMED = (
    'Motion is allowed again. Arm and hand leave the table if they are over it; a motion that was '
    'stopped is not continued.'
)


class HoldKeeperNode(Node):
    """Keeps the hold of one cell on disk and tells everything that moves.

    Publishes:
        cell/hold_state (HoldState, reliable, transient local, depth 1): 20 Hz by the steady clock,
            and at once on every change
        cell/holds (HoldState, reliable, transient local, depth 16): each hold and resume
        heartbeat (Heartbeat), /diagnostics (DiagnosticArray, 1 Hz, WARN while held)
    Subscribes:
        cell/stop (String: who): hold; heard by the motor drivers as well, without the way over
            this node
    Serves:
        cell/hold, cell/resume (Trigger)

    The file is `hold` in the state folder of the cell, see likeme_core.state_folder. A hold that
    cannot be written counts, and the message says that it would not outlive this process; a
    resume that cannot be written is refused.
    """

    def __init__(self) -> None:
        super().__init__('hold_keeper')
        conflicts = other_servers(self, ['cell/hold'])
        if conflicts:
            raise ValueError(conflicts[0])
        path = state_folder_of(self) / 'hold'
        self._lock = only_one(path)
        self._latch = HoldLatch(path)
        self._state_pub = self.create_publisher(HoldState, 'cell/hold_state', LATCHED)
        self._changes_pub = self.create_publisher(HoldState, 'cell/holds', kept(HISTORY))
        self._heartbeat = HeartbeatPublisher(self, self._health)
        self._diagnostics = DiagnosticsPublisher(self)
        self.create_subscription(String, 'cell/stop', self._on_stop, 10)
        self.create_service(Trigger, 'cell/hold', self._on_hold)
        self.create_service(Trigger, 'cell/resume', self._on_resume)
        for change in self._latch.history:
            self._changes_pub.publish(self._message(change))
        self._publish_state()
        self.create_timer(STATE_PERIOD, self._publish_state, clock=steady_clock())
        self.create_timer(1.0, self._diagnose, clock=steady_clock())
        self.get_logger().info(self._describe())

    def destroy_node(self) -> None:
        """Let another keeper take over, and destroy the node."""
        self._lock.close()
        super().destroy_node()

    def _on_stop(self, message: String) -> None:
        self._hold(message.data or 'cell/stop', 'stopped')

    def _on_hold(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        before = self._latch.state
        # The service does not say who calls it, and does not hide who held before.
        self._hold(before.by if before.held else 'cell/hold', 'held')
        response.success = True
        response.message = 'The cell was held already.' if before.held else 'The cell is held.'
        if self._latch.problem:
            response.message += f' This hold is not on disk: {self._latch.problem}.'
        return response

    def _on_resume(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        before = self._latch.state
        try:
            # Also when nothing is held: a driver stopped while no keeper ran waits for it.
            change = self._latch.resume('cell/resume', 'resumed')
        except OSError as error:
            response.success = False
            response.message = f'The cell stays held: the resume cannot be written: {error}.'
            return response
        self._tell(change)
        response.success = True
        response.message = RESUMED if before.held else 'Nothing was held.'
        return response

    def _hold(self, by: str, reason: str) -> None:
        before = self._latch.state
        # A stop that is repeated until it is confirmed is a change each time, and told once.
        self._tell(self._latch.hold(by, reason), (before.held, before.by) != (True, by))

    def _tell(self, change: HoldChange, logged: bool = True) -> None:
        self._publish_state()
        self._changes_pub.publish(self._message(change))
        if logged:
            verb = 'Held' if change.held else 'Resumed'
            self.get_logger().info(f'{verb} by {change.by}.')

    def _publish_state(self) -> None:
        self._state_pub.publish(self._message(self._latch.state))

    def _message(self, change: HoldChange) -> HoldState:
        message = HoldState(
            run=self._heartbeat.run, held=change.held, change=change.change, by=change.by,
            reason=change.reason,
        )  # fmt: skip
        message.header.stamp = self.get_clock().now().to_msg()
        return message

    def _describe(self) -> str:
        state = self._latch.state
        if not state.held:
            return 'Motion is allowed.'
        since = time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(state.change / 1e9))
        return (
            f'The cell is held since {since} by {state.by} ({state.reason}): '
            'cell/resume allows motion.'
        )

    def _health(self) -> tuple[NodeState, str]:
        problem = self._latch.problem
        if problem:
            return NodeState.DEGRADED, f'The last hold is not on disk: {problem}.'
        return NodeState.READY, ''

    def _diagnose(self) -> None:
        state = self._latch.state
        level = DiagnosticStatus.WARN if state.held else DiagnosticStatus.OK
        values = {'held': state.held, 'change': state.change, 'by': state.by}
        stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(
            diagnostics_msg('hold_keeper', level, self._describe(), values, stamp)
        )


def only_one(path: Path) -> BinaryIO:
    """Lock the file of the hold for this keeper, as long as the result is kept.

    Raises:
        OSError: another keeper of this host has it.
    """
    lock = path.with_suffix('.lock').open('ab')
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        lock.close()
        raise OSError(
            f'Expected no other hold keeper of this cell, got one that keeps {path}.'
        ) from None
    return lock


#: Of a standby process.
preload = join_graph


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node('hold_keeper', HoldKeeperNode)


if __name__ == '__main__':
    sys.exit(main())
