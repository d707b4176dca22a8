"""The demo as a user runs it: real processes, real DDS, the camera as the only witness."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import psutil
import pytest
from typer.testing import CliRunner

from graph import Graph
from likeme_bringup.demo import main
from likeme_core.typer_app import App

pytestmark = [pytest.mark.graph, pytest.mark.slow]


def demo(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, '-m', 'likeme_bringup.demo', '--out', str(folder), *arguments]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=180, stdin=subprocess.DEVNULL, check=False
    )


def in_order(text: str, *parts: str) -> None:
    """Assert that the parts stand in the text in this order."""
    rest = ' '.join(text.split())
    for part in parts:
        _, found, rest = rest.partition(part)
        assert found, f'Expected {part!r} after what came before it, got:\n{text}'


def completed(folder: Path) -> subprocess.CompletedProcess[str]:
    """A story told to its good end; one in which the robot missed, and said so, is told again."""
    for seed in ('1', '2', '3'):
        told = demo(folder, '--seed', seed)
        if told.returncode == 0:
            break
        assert told.returncode == 1, told.stdout + told.stderr
        assert 'missed by PUSH_LEFT' in ' '.join(told.stdout.split()), told.stdout
    return told


@pytest.mark.timeout(600)
def test_the_papers_story_is_completed(tmp_path: Path) -> None:
    told = completed(tmp_path)
    assert told.returncode == 0, told.stdout + told.stderr + (tmp_path / 'cell.log').read_text()
    in_order(
        told.stdout,
        '1. chicken, RIGHT to LEFT',
        'the chicken went from RIGHT to LEFT',
        'P(G | x_i, x_f) = LEFT 0.88, RIGHT 0.12, OFFTABLE 0.00',
        'best action is PUSH_LEFT',
        'predicted probability 0.90',
        'The chicken is LEFT now',
        '2. pear, RIGHT to LEFT',
        'predicted probability 0.40, below the threshold 0.50',
        'The robot asks',
        'done by hand',
        'The pear is LEFT now',
        '2 of 2 acts',
    )
    picture = cv2.imread(str(tmp_path / 'story.png'))
    assert picture is not None
    assert picture.shape[1] > 1500


def test_a_story_that_cannot_be_told_is_refused(tmp_path: Path) -> None:
    told = demo(tmp_path, '--show', 'offtable', 'left')
    assert told.returncode == 2
    assert 'OFFTABLE to LEFT' in told.stderr


def refused(*words: str) -> str:
    """What the demo says in this process when it refuses its options."""
    app = App(rich_markup_mode=None)
    app.command()(main)
    told = CliRunner().invoke(app, words)
    assert told.exit_code == 2, told.output
    assert isinstance(told.exception, SystemExit)
    return told.stderr


def test_what_the_robot_never_tried_is_refused(tmp_path: Path) -> None:
    said = refused('--out', str(tmp_path), '--object', 'banana')
    assert "Expected one of pear, lemon, chicken, got 'banana'" in said


def test_a_torn_model_is_refused(tmp_path: Path) -> None:
    torn = tmp_path / 'torn.csv'
    torn.write_text('likeme_transition_model,1\nname,torn\n')
    assert 'torn.csv: line 3' in refused('--out', str(tmp_path), '--model', str(torn))


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / 'file').touch()
    assert 'Not a directory' in refused('--out', str(tmp_path / 'file' / 'out'))


def test_sigterm_ends_the_demo_and_its_cell(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        demo = graph.start('likeme_bringup.demo', '--out', str(tmp_path))
        graph.until(lambda: 'The cell is ready' in demo.said, 60, 'the cell')
        children = psutil.Process(demo.pid).children(recursive=True)
        assert len(children) == 5, children
        os.kill(demo.pid, signal.SIGTERM)
        assert demo.wait(30) == 130, demo.said
    assert demo.said.endswith('The demo stops here. Interrupted.\n')
    assert 'Traceback' not in demo.said
    assert not [child for child in children if child.is_running()]
