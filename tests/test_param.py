"""param.sh as a person uses it, on a running inference node."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from domain_coordinator import domain_id

from graph import Graph
from in_process import command
from likeme_bringup.ros import param_command

pytestmark = pytest.mark.graph


def test_parameters_are_listed_told_and_changed(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        node = graph.start('likeme_inference.inference_node')

        def param(*words: str) -> tuple[int, str]:
            told = subprocess.run(
                [sys.executable, '-m', 'likeme_bringup.ros.param_command', *words, '--domain',
                 str(graph.domain)],
                capture_output=True, text=True, timeout=60, check=False,
            )  # fmt: skip
            assert 'Traceback' not in told.stderr
            return told.returncode, (told.stderr or told.stdout).strip()

        node_name = 'inference_node'
        assert param('set', node_name, 'help_threshold', '1') == (
            0, 'inference_node: help_threshold is 1 now.',
        )  # fmt: skip
        assert param('get', node_name, 'help_threshold') == (0, '1.0')
        assert param('set', node_name, 'goal_prior', '[1, 0, 0]')[0] == 0
        code, said = param('list', node_name)
        assert code == 0
        assert 'goal_prior: [1.0, 0.0, 0.0]   # p(LEFT), p(RIGHT), p(OFFTABLE)' in said
        assert (
            'help_threshold: 1.0   # predicted success below which the robot asks (0 to 1)' in said
        )
        assert param('set', node_name, 'mode', 'telepathy') == (
            1, "Expected one of the modes trajectory, goal_based, interactive, sequential, got "
            "'telepathy'.",
        )  # fmt: skip
        assert param('set', node_name, 'threshold', '0.3')[0] == 2
        assert param('list') == (0, '/inference_node')
        absent = f'There is no node inferense_node on ROS domain {graph.domain}.'
        assert param('list', 'inferense_node') == (3, f'{absent} The nearest: /inference_node.')
        assert 'goal_prior = [1.0, 0.0, 0.0]' in node.said


def test_an_absent_node_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(param_command, 'DISCOVERY_TIMEOUT', 0.5)
    with domain_id() as domain:
        told = command(param_command.param, domain, 'get', 'nobody', 'mode')
    said = f'There is no node nobody on ROS domain {domain}. No other node is there: '
    assert (told.code, told.stdout) == (3, '')
    assert told.stderr.startswith(said)
