"""gaze.sh as a user runs it: real processes, real DDS."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import psutil
import pytest
import typer
from typer.testing import CliRunner

from graph import Graph, NodeProcess
from likeme_experiments.gaze_mentor import main

pytestmark = pytest.mark.graph


def gaze(graph: Graph, *arguments: str) -> NodeProcess:
    return graph.run('gaze', sys.executable, '-m', 'likeme_experiments.gaze_mentor', *arguments)


def scores(told: str) -> list[int]:
    """The score of every trial, in order."""
    return [int(n) for n in re.findall(r'^ +\d+  (?:left|right).* ([+-]?\d+)$', told, re.M)]


def test_open_eyes_are_followed(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        told = gaze(graph, '--trials', '3', '--distance', '--points', '60')
        assert told.wait(60) == 0, told.said
        assert scores(told.said) == [1, 1, 1]
        assert 'Score +3 of 3, mean 1.00' in told.said
        assert 'A mentor 6.0 m away turns its head by 45 degrees with open eyes' in told.said


def test_a_blindfold_is_followed_until_the_robot_has_worn_one(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        told = gaze(graph, '--trials', '2', '--blindfold', '--points', '60')
        assert told.wait(60) == 0, told.said
        naive, knowing = told.said.split('wore an opaque blindfold')
        assert 'never wore a blindfold' in naive
        assert (scores(naive), scores(knowing)) == ([1, 1], [0, 0])


def test_a_node_that_runs_is_used_and_left_as_it_was(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        node = graph.start('likeme_gaze.gaze_node', training_points=60, observations=2)
        told = gaze(
            graph, '--no-start', '--trials', '1', '--blindfold', '--experience', 'windowed'
        )
        assert told.wait(60) == 0, told.said
        assert 'learned from 60 movements' in told.said
        assert scores(told.said) == [1]
        assert node.alive
        changes = re.findall(r'From the next start pose on: (.*)\.', node.said)
        assert changes == [
            "mentor_blindfolded = True, blindfold_experience = 'windowed'",
            "mentor_blindfolded = False, blindfold_experience = 'none'",
        ]


def test_two_nodes_are_one_too_many(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        other = graph.start('likeme_gaze.gaze_node', training_points=60)
        graph.until(lambda: 'I learned' in other.said, 30, 'the other node')
        told = gaze(graph, '--points', '60', '--trials', '1000')
        assert told.wait(60) == 1, told.said
        assert f'Expected one gaze node on ROS domain {graph.domain}, got 2' in told.said
        assert 'Traceback' not in told.said
        assert other.alive


def test_without_a_node_it_says_so(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        told = gaze(graph, '--no-start')
        assert told.wait(30) == 1
        assert told.said == (
            f'gaze: Expected gaze_node on ROS domain {graph.domain} within 8 s, got nothing.\n'
        )


def test_a_node_that_cannot_learn_is_quoted(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        told = gaze(graph, '--points', '3')
        assert told.wait(30) == 1
        assert told.said == (
            'gaze: The gaze node ended with exit code 1: gaze_node does not start: Expected at '
            'least 5 training points, got 3.\n'
        )


def test_a_node_that_dies_half_way_is_noticed(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        told = gaze(graph, '--trials', '1000', '--points', '60')
        graph.until(lambda: scores(told.said), 60, 'a first trial')
        (node,) = psutil.Process(told.pid).children()
        node.kill()
        assert told.wait(20) == 1
        assert 'gaze: The gaze node ended with exit code -9: ' in told.said
        assert 'Traceback' not in told.said


def test_ctrl_c_ends_both(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        told = gaze(graph, '--trials', '1000', '--points', '60')
        graph.until(lambda: scores(told.said), 60, 'a first trial')
        (node,) = psutil.Process(told.pid).children()
        assert told.stop() == 130
        assert told.said.endswith('gaze: interrupted.\n')
        assert not node.is_running()


@pytest.mark.parametrize(
    'arguments', [['--trials', '0'], ['--experience', 'wool'], ['--seed', '-1'], ['--points', 'x']]
)
def test_wrong_usage_is_refused_before_anything_starts(arguments: list[str]) -> None:
    app = typer.Typer()
    app.command()(main)
    assert CliRunner().invoke(app, arguments).exit_code == 2
