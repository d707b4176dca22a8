"""gaze.sh as a user runs it: real processes, real DDS."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import psutil
import pytest
from domain_coordinator import domain_id
from typer.testing import CliRunner

from graph import Graph, NodeProcess
from in_process import command
from likeme_core.typer_app import App
from likeme_experiments.commands import gaze as gaze_command

pytestmark = pytest.mark.graph


def gaze(graph: Graph, *arguments: str) -> NodeProcess:
    return graph.run('gaze', sys.executable, '-m', 'likeme_experiments.commands.gaze', *arguments)


def scores(output: str) -> list[int]:
    """The score of every trial, in order."""
    return [int(n) for n in re.findall(r'^ +\d+  (?:left|right).* ([+-]?\d+)$', output, re.M)]


def test_open_eyes_are_followed(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        run = gaze(graph, '--trials', '3', '--distance', '--points', '60')
        assert run.wait(60) == 0, run.said
        assert scores(run.said) == [1, 1, 1]
        assert 'Score +3 of 3, mean 1.00' in run.said
        assert 'A mentor 6.0 m away turns its head by 45 degrees with open eyes' in run.said


def test_a_blindfold_is_followed_until_the_robot_has_worn_one(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        run = gaze(graph, '--trials', '2', '--blindfold', '--points', '60')
        assert run.wait(60) == 0, run.said
        naive, knowing = run.said.split('wore an opaque blindfold')
        assert 'never wore a blindfold' in naive
        assert (scores(naive), scores(knowing)) == ([1, 1], [0, 0])


def test_a_running_node_is_used_and_its_parameters_restored(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        node = graph.start('likeme_gaze.gaze_node', training_points=60, observations=2)
        run = gaze(graph, '--no-start', '--trials', '1', '--blindfold', '--experience', 'windowed')
        assert run.wait(60) == 0, run.said
        assert 'learned from 60 movements' in run.said
        assert scores(run.said) == [1]
        assert node.alive
        changes = re.findall(r'From the next start pose on: (.*)\.', node.said)
        assert changes == [
            "mentor_blindfolded = True, blindfold_experience = 'windowed'",
            "mentor_blindfolded = False, blindfold_experience = 'none'",
        ]


def test_two_gaze_nodes_are_an_error(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        other = graph.start('likeme_gaze.gaze_node', training_points=60)
        graph.until(lambda: 'Trained on' in other.said, 30, 'the other node')
        run = gaze(graph, '--points', '60', '--trials', '1000')
        assert run.wait(60) == 1, run.said
        assert f'Expected one gaze node on ROS domain {graph.domain}, got 2' in run.said
        assert 'Traceback' not in run.said
        assert other.alive


def test_a_missing_gaze_node_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gaze_command, 'DISCOVERY_TIMEOUT', 0.5)
    with domain_id() as domain:
        told = command(gaze_command.run, domain, '--no-start')
    assert told.code == 1
    assert told.stderr == (
        f'gaze: Expected gaze_node on ROS domain {domain} within 0.5 s, got nothing.\n'
    )


def test_the_last_line_of_a_failed_node_is_reported(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        run = gaze(graph, '--points', '3')
        assert run.wait(30) == 1
        assert run.said == (
            'gaze: The gaze node ended with exit code 78: gaze_node does not start: Expected at '
            'least 5 training points, got 3.\n'
        )


def test_a_killed_node_is_reported(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        run = gaze(graph, '--trials', '1000', '--points', '60')
        graph.until(lambda: scores(run.said), 60, 'a first trial')
        (node,) = psutil.Process(run.pid).children()
        node.kill()
        assert run.wait(20) == 1
        assert 'gaze: The gaze node ended with exit code -9: ' in run.said
        assert 'Traceback' not in run.said


def test_ctrl_c_ends_both(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        run = gaze(graph, '--trials', '1000', '--points', '60')
        graph.until(lambda: scores(run.said), 60, 'a first trial')
        (node,) = psutil.Process(run.pid).children()
        assert run.stop() == 130
        assert run.said.endswith('gaze: interrupted.\n')
        assert not node.is_running()


@pytest.mark.parametrize(
    'arguments', [['--trials', '0'], ['--experience', 'wool'], ['--seed', '-1'], ['--points', 'x']]
)
def test_invalid_options_are_rejected(arguments: list[str]) -> None:
    app = App()
    app.command()(gaze_command.main)
    assert CliRunner().invoke(app, arguments).exit_code == 2
