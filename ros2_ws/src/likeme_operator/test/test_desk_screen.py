"""The screen in a real pseudo-terminal, on real nodes with a fake camera and a scripted arm."""

from __future__ import annotations

import os
import re
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Protocol

import pytest
from fakes import Arm, Camera, make_request

from graph import HOLD_KEEPER, Graph, NodeProcess
from likeme_core.paper_world import WORLD
from likeme_core.ros.time import time_msg
from likeme_msgs.msg import Attempt, TableState

for _name in ('textual', 'pyte'):
    pytest.importorskip(_name, reason=f'{_name}: scripts/operator.sh installs it')

from terminal import Terminal  # noqa: E402

pytestmark = [pytest.mark.graph, pytest.mark.timeout(280)]
HANDBOOK = Path(__file__).parents[4] / 'docs' / 'operator.md'
TASKS = re.findall(r'^\| ([^|]+) \| ((?:`[^`]+` ?)*)\| `([^`]+)` \|$', HANDBOOK.read_text(), re.M)
COMMAND = (sys.executable, '-m', 'likeme_operator', '--by', 'Ada')


class Screen(Protocol):
    """What a person sees and types into."""

    def shows(self, words: str, timeout: float = 10) -> str:
        """Read until some words are on the screen; the screen."""

    def type(self, *keys: str) -> None:
        """Press keys."""

    def read(self, timeout: float) -> None:
        """Take in what is written within a time, s."""


class Desk:
    """A graph that can have a question about the pear."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        graph.start(HOLD_KEEPER)
        self.node: NodeProcess = graph.start('likeme_inference.inference_node')
        self.camera = Camera(graph)
        self.arm = Arm(graph, self.camera)
        self.terminals: list[Terminal] = []

    def open(self, *words: str, columns: int = 80, lines: int = 24) -> Terminal:
        """Another screen."""
        terminal = Terminal(
            [*COMMAND, *words], self.graph.env, columns, lines, lambda: self.graph.during(0.02)
        )
        self.terminals.append(terminal)
        return terminal

    def ask(self, screen: Screen) -> int:
        """Have the robot ask about the pear, until it is on a screen; its number."""
        number = make_request(self.graph, self.camera)
        screen.shows(f'answer question {number}, pear')
        # A person reads it first.
        screen.read(0.6)
        return number

    def do_tasks(self, screen: Screen) -> None:
        """Do what the handbook lists."""
        screen.shows('MOTION ALLOWED', 20)
        self.ask(screen)
        for task, keys, words in TASKS:
            if task.startswith('answer the next question'):
                self.ask(screen)
            for key in re.findall('`([^`]+)`', keys):
                if key == 'Enter':
                    # It counts when what it does was on the screen for a while.
                    screen.shows('Enter does it')
                    screen.read(0.6)
                screen.type(key)
                if key == 'Esc':
                    # With the next byte it would be another key.
                    screen.read(0.5)
            screen.shows(words)
        assert [request.action for request in self.arm.requests] == ['PUSH_LEFT']


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    with Graph(tmp_path) as graph:
        desk = Desk(graph)
        yield desk
        for terminal in desk.terminals:
            terminal.close()


def test_the_handbook_has_short_tasks() -> None:
    assert len(TASKS) >= 12
    assert all(len(re.findall('`[^`]+`', keys)) <= 5 for _, keys, _ in TASKS)


def test_the_tasks_of_the_handbook(desk: Desk) -> None:
    screen = desk.open()
    desk.do_tasks(screen)
    assert screen.bells > 0
    screen.type('q')
    assert screen.ends(20) == 0
    assert screen.restored


def test_the_tasks_of_the_handbook_in_a_browser(desk: Desk, tmp_path: Path) -> None:
    why = 'websockets: scripts/foxglove.sh installs it'
    browser = pytest.importorskip('browser', reason=why, exc_type=ImportError)
    if browser.CHROMIUM is None:
        pytest.skip('Expected chromium, which is not installed.')
    with closing(socket.socket()) as listener:
        listener.bind(('localhost', 0))
        port = listener.getsockname()[1]
    server = desk.graph.run('desk', *COMMAND, '--web', '--port', str(port))
    desk.graph.until(lambda: "The operator's desk: http" in server.said, 20, 'a page')
    url, turn = f'http://localhost:{port}', lambda: desk.graph.during(0.02)
    with browser.BrowserScreen(url, tmp_path / 'chromium', turn) as screen:
        desk.do_tasks(screen)
        assert screen.picture().startswith(b'\x89PNG')


def test_keys_before_a_question_are_not_its_answer(desk: Desk) -> None:
    screen = desk.open()
    screen.shows('MOTION ALLOWED', 20)
    screen.type('t', 'Enter', 't', 'Enter')
    number = desk.ask(screen)
    screen.shows('ASKING')
    assert desk.arm.requests == []
    # Another operator is faster while a dialog is open.
    other = desk.open('--plain', '--by', 'Bob')
    other.shows(f'Request {number}', 20)
    screen.type('t')
    screen.shows('Enter does it')
    other.type('3', 'Enter')
    told = f'Nothing was sent for question {number}. Request {number} was answered by Bob'
    screen.shows(told)
    assert desk.arm.requests == []


def test_an_act_under_way_and_another_world_s_messages(desk: Desk) -> None:
    screen = desk.open()
    screen.shows('MOTION ALLOWED', 20)
    screen.shows('no hand, no arm', 20)
    attempts = desk.graph.publisher(Attempt, 'attempt')
    act = Attempt(
        object='pear', manner=0, manner_probability=0.9, direction=0, x_i=1, x_f=Attempt.UNKNOWN,
        x_i_probability=[0.0, 1.0, 0.0], under_way=True, world=WORLD.label,
    )  # fmt: skip
    act.header.stamp = act.start = act.end = time_msg(desk.camera.stamp)
    attempts.publish(act)
    screen.shows('now: pear RIGHT>LEFT? place .90')
    desk.camera.stop()
    desk.graph.publisher(TableState, 'table_state', 1).publish(TableState(world='other@1'))
    screen.shows('Messages of the world other@1 are not shown, the cell is of chung2015@')
    screen.shows('No table state was heard yet.')


def test_the_inference_node_dies_under_an_open_dialog(desk: Desk) -> None:
    screen = desk.open()
    screen.shows('MOTION ALLOWED', 20)
    desk.ask(screen)
    screen.type('t')
    screen.shows('Enter does it')
    desk.node.signal(signal.SIGKILL)
    screen.shows('The inference node is not heard any more: nothing was sent.')
    screen.shows('ALARM inference_node is silent, nothing is decided')


def test_sizes_and_signals(desk: Desk) -> None:
    screen = desk.open()
    screen.shows('MOTION ALLOWED', 20)
    screen.resize(60, 20)
    screen.shows('Expected a terminal of 80x24 or more, got 60x20.')
    screen.resize(120, 40)
    screen.shows('MOTION ALLOWED')
    small = desk.open(columns=79)
    assert small.ends(20) == 2
    assert 'Expected a terminal of 80x24 or more, got 79x24.' in small.text
    second = desk.open()
    second.shows('also here: Ada', 20)
    screen.process.send_signal(signal.SIGTERM)
    os.write(second.master, b'\x03')
    for each in (screen, second):
        assert each.ends(20) == 0
        assert each.restored
        assert 'Traceback' not in each.raw.decode(errors='replace')
