"""topic.sh as a person uses it, on a hold keeper."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from pathlib import Path

import pytest
from domain_coordinator import domain_id

from graph import HOLD_KEEPER, Graph
from in_process import command
from likeme_bringup.ros import topic_commands


@pytest.mark.graph
def test_topics_are_listed_shown_and_measured(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start(HOLD_KEEPER)

        def topic(*words: str) -> subprocess.CompletedProcess[str]:
            told = subprocess.run(
                [sys.executable, '-m', 'likeme_bringup.ros.topic_commands', *words, '--domain',
                 str(graph.domain)],
                capture_output=True, text=True, timeout=60, check=False,
            )  # fmt: skip
            assert 'Traceback' not in told.stderr
            return told

        listed = json.loads(topic('list', '--json').stdout)
        echoed = json.loads(topic('echo', 'cell/hold_state', '-n', '1', '--json').stdout)
        shown = topic('echo', 'hold_state', '-n', '1').stdout
        rate = json.loads(topic('hz', 'heartbeat', '--seconds', '2', '--json').stdout)
        wrong = topic('hz', 'holdstate')

        assert listed['/cell/hold_state']['type'] == 'likeme_msgs/msg/HoldState'
        assert listed['/cell/hold_state']['publishers'] == 1
        assert echoed['held'] is False
        assert 'held: false\n' in shown
        assert rate['messages'] > 5
        assert wrong.returncode == 3
        assert wrong.stderr.startswith(f'There is no topic holdstate on ROS domain {graph.domain}')
        assert '/cell/hold_state' in wrong.stderr


def test_without_a_graph_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(topic_commands, 'DISCOVERY_TIMEOUT', 0.5)
    # No domain of the other tests, whose killed nodes stay listed for 20 s.
    with domain_id(lambda: random.randrange(215, 232)) as domain:
        told = command(topic_commands.topic, domain, 'list')
    assert (told.code, told.stdout) == (3, '')
    assert told.stderr.startswith(f'No other node on ROS domain {domain}: is the cell running?')
