"""The monitor beside a running cell."""

from __future__ import annotations

from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from graph import LATCHED, Graph
from likeme_msgs.msg import HoldState


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
