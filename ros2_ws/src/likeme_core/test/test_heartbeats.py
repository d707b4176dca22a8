from __future__ import annotations

from likeme_core.heartbeats import Change, HeartbeatMonitor, NodeState

ARM = '/arm_driver'


def test_a_node_is_alive_while_its_heartbeats_come() -> None:
    monitor = HeartbeatMonitor(timeout=0.25)
    assert not monitor.alive(ARM, 0.0)
    assert monitor.silence(ARM, 0.0) == float('inf')
    assert monitor.hear(ARM, 'a', 1.0) is Change.FIRST
    assert monitor.hear(ARM, 'a', 1.2) is None
    assert monitor.alive(ARM, 1.4)
    assert not monitor.alive(ARM, 1.5)
    assert monitor.silence(ARM, 1.5) == 1.5 - 1.2


def test_a_silent_node_is_back_and_a_new_run_is_a_restart() -> None:
    monitor = HeartbeatMonitor(timeout=0.25)
    monitor.hear(ARM, 'a', 0.0)
    assert monitor.hear(ARM, 'a', 1.0) is Change.BACK
    assert monitor.hear(ARM, 'b', 1.1, NodeState.STARTING, 'the model is read') is Change.RESTARTED
    record = monitor.nodes[ARM]
    assert (record.run, record.restarts, record.state) == ('b', 1, NodeState.STARTING)
    assert record.message == 'the model is read'


def test_a_late_heartbeat_of_a_run_that_was_replaced_changes_nothing() -> None:
    monitor = HeartbeatMonitor()
    monitor.hear(ARM, 'a', 0.0)
    monitor.hear(ARM, 'b', 1.0)
    assert monitor.hear(ARM, 'a', 1.05) is None
    assert monitor.nodes[ARM].run == 'b'
    assert monitor.nodes[ARM].heard == 1.0


def test_a_state_of_later_software_counts_as_degraded() -> None:
    monitor = HeartbeatMonitor()
    monitor.hear(ARM, 'a', 0.0, state=200)
    assert monitor.nodes[ARM].state is NodeState.DEGRADED
