"""Checks the policies of the cell while it runs."""

from __future__ import annotations

import sys
import time
from heapq import heappop, heappush
from itertools import count
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from likeme_core.ros.diagnostics import DiagnosticsPublisher, diagnostics_msg
from likeme_core.ros.message_types import message_class
from likeme_core.ros.spin import run_node
from likeme_core.ros.time import steady_clock
from likeme_core.stamps import SECOND
from likeme_msgs.srv import AskHuman
from likeme_replay.policies.monitor import PolicyMonitor
from likeme_replay.policies.policy import QUESTIONS, TOPICS

#: Topics whose publishers keep messages for late subscribers.
LATCHED_TOPICS = (
    'world', 'goal_belief', 'decision_record', 'decision', 'outcome', 'motion', 'cell/hold_state',
    'cell/holds',
)  # fmt: skip
BEST_EFFORT_TOPICS = ('heartbeat',)
#: Topics with one publisher of which it matters whether messages were missed.
COUNTED_TOPICS = ('cell/hold_state', 'table_state')
QUEUE_DEPTH = 200
#: s for which messages are held back to put those of all topics into the order of their sending.
REORDERING = 0.5
CHECK_PERIOD = 0.05
POLL_PERIOD = 0.5
#: s in which messages were missed that are worth a warning.
GAP_WARNING = 0.2


class PolicyMonitorNode(Node):
    """Checks every policy on the topics of a running cell, and changes nothing.

    Subscribes: the topics of policies.policy.TOPICS.
    Publishes:
        /diagnostics (DiagnosticArray, 1 Hz): ERROR after the first violation, with their counts
    Client:
        ask_human (AskHuman): LIST, twice a second while it is there

    Each violation is an error in the log, half a second after the message that shows it. Messages
    from before the start, such as latched ones, are remembered but not judged.
    """

    def __init__(self) -> None:
        super().__init__('policy_monitor')
        self._monitor = PolicyMonitor()
        self._started = self._due = time.time_ns()
        self._numbers = count()
        self._waiting: list[tuple[int, int, int, str, Any]] = []
        self._last: dict[str, tuple[str, int, int]] = {}
        # How long messages waited in this process's queues lately, ns.
        self._lag = 0
        for topic, kind in TOPICS.items():
            self._subscribe(topic, message_class(kind))
        self._asking = self.create_client(AskHuman, 'ask_human')
        self._asked: Any = None
        self._diagnostics = DiagnosticsPublisher(self)
        for period, callback in (
            (CHECK_PERIOD, self._check), (POLL_PERIOD, self._poll), (1.0, self._diagnose)
        ):  # fmt: skip
            self.create_timer(period, callback, clock=steady_clock())
        self.get_logger().info('Watching the policies of the cell.')

    def _subscribe(self, topic: str, kind: Any) -> None:
        def receive(message: Any, info: dict[str, Any]) -> None:
            # rclpy inspects the signature: with two parameters it passes the times.
            self._receive(topic, message, info)

        name = f'/{topic}' if topic == 'parameter_events' else topic
        # Annotated for callbacks with one parameter.
        self.create_subscription(kind, name, receive, _qos(topic))  # type: ignore[arg-type]

    def _receive(self, topic: str, message: Any, info: dict[str, Any]) -> None:
        sent = int(info.get('source_timestamp') or 0) or time.time_ns()
        if topic in COUNTED_TOPICS:
            number = int(info.get('publication_sequence_number') or 0)
            self._find_gap(topic, getattr(message, 'run', ''), number, sent)
        received = int(info.get('received_timestamp') or 0) or sent
        self._lag = max(self._lag, time.time_ns() - received)
        self._add(sent, received, topic, message)

    def _find_gap(self, topic: str, run: str, number: int, sent: int) -> None:
        """Notice messages that this process missed, as when it got no processor time.

        run: of the publisher, where the message says it. number: counted by the publisher; one
        that is not greater is that of another publisher. sent: ns.
        """
        last_run, last, since = self._last.get(topic, (run, number, sent))
        self._last[topic] = run, number, sent
        if number > last + 1 and run == last_run:
            self._monitor.miss(topic, since / SECOND, sent / SECOND)
            if sent - since > GAP_WARNING * SECOND:
                self.get_logger().warning(
                    f'{number - last - 1} messages of {topic} within '
                    f'{(sent - since) / SECOND:.1f} s were missed: not all is judged.'
                )

    def _add(self, sent: int, received: int, topic: str, message: Any) -> None:
        heappush(self._waiting, (sent, next(self._numbers), received, topic, message))

    def _check(self) -> None:
        # What was due at the last check: if this process was stopped, not all has been taken yet.
        # Nor has it while messages wait in queues: those of one topic may be ahead of another's.
        due, self._due = self._due, time.time_ns() - round(REORDERING * SECOND) - self._lag
        self._lag //= 2
        while self._waiting and self._waiting[0][0] <= due:
            sent, _, received, topic, message = heappop(self._waiting)
            if sent < self._started:
                self._monitor.remember(topic, message, sent / SECOND)
                continue
            arrived = received / SECOND
            self._report(self._monitor.hear(topic, message, sent / SECOND, arrived))
        self._report(self._monitor.tick(due / SECOND))

    def _report(self, violations: Any) -> None:
        for violation in violations:
            self.get_logger().error(f'{violation.policy}: {violation.sentence}')

    def _poll(self) -> None:
        if self._asked is not None and not self._asked.done():
            # The node that was asked is gone: ask the next one.
            self._asking.remove_pending_request(self._asked)
        self._asked = None
        if self._asking.service_is_ready():
            self._asked = self._asking.call_async(AskHuman.Request(command=AskHuman.Request.LIST))
            self._asked.add_done_callback(self._on_questions)

    def _on_questions(self, future: Any) -> None:
        now = time.time_ns()
        self._add(now, now, QUESTIONS, future.result())

    def _diagnose(self) -> None:
        counts = self._monitor.counts
        broken = sum(counts.values())
        message = f'{broken} violations.' if broken else 'No policy is broken.'
        if broken:
            last = self._monitor.violations[-1]
            message += f' The last: {last.policy}: {last.sentence}'
        level = DiagnosticStatus.ERROR if broken else DiagnosticStatus.OK
        values = {'messages': self._monitor.messages, **counts}
        stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(diagnostics_msg('policy_monitor', level, message, values, stamp))


def _qos(topic: str) -> QoSProfile:
    latched, best_effort = DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.BEST_EFFORT
    return QoSProfile(
        depth=QUEUE_DEPTH,
        durability=latched if topic in LATCHED_TOPICS else DurabilityPolicy.VOLATILE,
        reliability=best_effort if topic in BEST_EFFORT_TOPICS else ReliabilityPolicy.RELIABLE,
    )


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node('policy_monitor', PolicyMonitorNode)


if __name__ == '__main__':
    sys.exit(main())
