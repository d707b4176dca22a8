from __future__ import annotations

import math

from likeme_core.heartbeats import HeartbeatMonitor, NodeState

ARM = '/arm_driver'


def test_silence_counts_from_the_last_heartbeat() -> None:
    monitor = HeartbeatMonitor()
    assert monitor.silence(ARM, 0.0) == math.inf
    assert not monitor.alive(ARM, 0.0)
    monitor.hear(ARM, 'a', 1.0)
    monitor.hear(ARM, 'a', 1.2)
    assert monitor.silence(ARM, 1.5) == 1.5 - 1.2
    assert monitor.alive(ARM, 1.4)
    assert not monitor.alive(ARM, 1.5)
    assert monitor.nodes[ARM].restarts == 0


def test_a_new_run_is_a_restart() -> None:
    monitor = HeartbeatMonitor()
    monitor.hear(ARM, 'a', 0.0)
    monitor.hear(ARM, 'a', 1.0)
    monitor.hear(ARM, 'b', 1.1, NodeState.STARTING, 'the model is read')
    record = monitor.nodes[ARM]
    assert (record.run, record.restarts, record.state) == ('b', 1, NodeState.STARTING)
    assert record.message == 'the model is read'


def test_a_late_heartbeat_of_a_run_that_was_replaced_changes_nothing() -> None:
    monitor = HeartbeatMonitor()
    monitor.hear(ARM, 'a', 0.0)
    monitor.hear(ARM, 'b', 1.0)
    monitor.hear(ARM, 'a', 1.05)
    assert monitor.nodes[ARM].run == 'b'
    assert monitor.nodes[ARM].heard == 1.0


def test_a_state_of_later_software_counts_as_degraded() -> None:
    monitor = HeartbeatMonitor()
    monitor.hear(ARM, 'a', 0.0, state=200)
    assert monitor.nodes[ARM].state is NodeState.DEGRADED
