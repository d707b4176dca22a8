"""The monitor beside a running cell."""

from __future__ import annotations

import signal
import time
from pathlib import Path
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import JointState

from graph import LATCHED, Graph
from likeme_core.stamps import SECOND
from likeme_msgs.msg import HoldState
from likeme_replay.ros.policy_monitor_node import PolicyMonitorNode


@pytest.mark.graph
def test_violations_are_reported_but_not_those_from_before_the_start(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        holds = graph.node.create_publisher(HoldState, 'cell/hold_state', LATCHED)
        holds.publish(HoldState(change=5))
        monitor = graph.start('likeme_replay.ros.policy_monitor_node')
        reports = graph.collect(DiagnosticArray, '/diagnostics')
        graph.until(lambda: reports, 20, 'a report')
        assert reports[-1].status[0].level == DiagnosticStatus.OK
        assert not monitor.said.count('ERROR')

        holds.publish(HoldState(change=4))
        graph.until(
            lambda: reports[-1].status[0].level == DiagnosticStatus.ERROR, 10, 'a violation'
        )
        assert 'holds_only_grow: Expected a change from 5 on, got 4.' in monitor.said
        assert reports[-1].status[0].message.startswith('1 violations.')


@pytest.mark.graph
def test_a_monitor_that_was_stopped_tells_that_from_a_keeper_that_is_silent(
    tmp_path: Path,
) -> None:
    with Graph(tmp_path) as graph:
        monitor = graph.start('likeme_replay.ros.policy_monitor_node')
        holds = graph.publisher(HoldState, 'cell/hold_state', LATCHED)
        joints = graph.publisher(JointState, 'joint_states')

        def move(seconds: float, keeper: bool) -> None:
            begin = now = time.monotonic()
            told = 0.0
            while (now := time.monotonic()) - begin < seconds:
                if keeper and now - told > 0.05:
                    holds.publish(HoldState(change=1))
                    told = now
                joints.publish(JointState(velocity=[0.5]))
                time.sleep(0.002)

        move(1.0, keeper=True)
        # For so long that more messages come than its queue in shared memory takes.
        monitor.signal(signal.SIGSTOP)
        move(2.0, keeper=True)
        monitor.signal(signal.SIGCONT)
        move(2.0, keeper=True)
        graph.until(lambda: 'messages of cell/hold_state' in monitor.said, 10, 'what was missed')
        assert 'joints_rest_unheard' not in monitor.said
        move(1.5, keeper=False)
        graph.until(lambda: 'joints_rest_unheard' in monitor.said, 10, 'a violation')


@pytest.mark.graph
def test_topics_are_compared_once_the_queues_of_both_are_taken(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        rclpy.init(domain_id=graph.domain)
        node = PolicyMonitorNode()
        try:
            begin = time.time_ns()

            def take(topic: str, message: Any, steps: range) -> None:
                """As by an executor that is 2 s late; 20 messages a second."""
                for step in steps:
                    sent = begin + step * SECOND // 20
                    times = {'source_timestamp': sent, 'received_timestamp': sent}
                    node._receive(topic, message, times)

            node._started = node._due = begin - 3 * SECOND
            take('cell/hold_state', HoldState(change=1), range(-50, -40))
            take('joint_states', JointState(velocity=[0.5]), range(-50, -10))
            for _ in range(2):
                node._check()
            take('cell/hold_state', HoldState(change=1), range(-40, 0))
            while node._waiting:
                node._check()
                time.sleep(0.01)
            assert not node._monitor.violations
        finally:
            node.destroy_node()
            rclpy.try_shutdown()
