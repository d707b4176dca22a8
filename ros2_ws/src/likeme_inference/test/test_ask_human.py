"""The ask_human command line and the real node: list, answer, keyboard, absent service."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from domain_coordinator import domain_id
from fakes import Arm, Camera

from graph import LATCHED, Graph
from in_process import command
from likeme_core.paper_world import WORLD
from likeme_inference import ask_human_node
from likeme_inference.console_replies import menu, read_reply
from likeme_inference.tabletop.values import Reply
from likeme_msgs.msg import Decision, Outcome

L, R, O = WORLD.states  # noqa: E741
COMMAND = (sys.executable, '-m', 'likeme_inference.ask_human_node')


def run(graph: Graph, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, *arguments],
        env=graph.env,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def make_request(graph: Graph, camera: Camera) -> int:
    """Demonstrate pear RIGHT to LEFT and put it back; the number of the request."""
    seen = graph.collect(Decision, 'decision', LATCHED)
    camera.show('pear', R, L)
    graph.until(lambda: seen and seen[-1].kind == Decision.AT_GOAL, 20, 'AT_GOAL')
    camera.show('pear', L, R)
    graph.until(lambda: seen[-1].kind == Decision.ASK_HUMAN, 10, 'ASK_HUMAN')
    return int(seen[-1].id)


def read_until(console: subprocess.Popen[str], end: str) -> str:
    """Read what a console says up to some words."""
    assert console.stdout is not None
    said = ''
    while not said.endswith(end):
        character = console.stdout.read(1)
        assert character, said
        said += character
    return said


def test_replies_are_read_by_word_number_and_abbreviation() -> None:
    typed = ['1', 'done', ' D ', '2', 'try', '3', 'sk']

    assert [read_reply(text) for text in typed] == [
        Reply.DONE_BY_HAND, Reply.DONE_BY_HAND, Reply.DONE_BY_HAND,
        Reply.TRY_ANYWAY, Reply.TRY_ANYWAY, Reply.SKIP, Reply.SKIP,
    ]  # fmt: skip
    for text in ('', '0', 'yes', 'doner'):
        with pytest.raises(ValueError, match='Expected one of done, try, skip, got'):
            read_reply(text)


def test_the_menu_says_what_follows() -> None:
    assert menu(list(Reply), 'pear', 'LEFT', 'PUSH_LEFT').splitlines() == [
        '  1  done  I did it by hand: the robot looks whether the pear is LEFT',
        '  2  try   try it anyway: the robot does PUSH_LEFT to the pear',
        '  3  skip  skip it: nothing moves',
    ]
    assert 'try' not in menu([Reply.DONE_BY_HAND, Reply.SKIP], 'pear', 'LEFT', 'PUSH_LEFT')


@pytest.mark.graph
def test_list_and_answer(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node')
        camera = Camera(graph)
        Arm(graph, camera)
        empty, nothing = run(graph, 'list'), run(graph, 'answer', '1', 'skip')
        number = make_request(graph, camera)
        listed = run(graph, 'list')
        bad = run(graph, 'answer', str(number), 'maybe')
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        lemon = run(graph, 'answer', str(number), 'try', '--object', 'lemon')
        accepted = run(graph, 'answer', str(number), 'try', '--by', 'Ada', '--object', 'Pear')
        graph.until(lambda: outcomes, 10, 'an outcome')
        second = run(graph, 'answer', str(number), 'skip', '--by', 'Bob')

        assert (empty.returncode, empty.stdout) == (0, 'Nothing is pending.\n')
        assert (nothing.returncode, nothing.stdout) == (1, '')
        assert 'Nothing is pending' in nothing.stderr
        assert f'Request {number}: I want the pear to go from RIGHT to LEFT' in listed.stdout
        assert 'best action PUSH_LEFT, p = 0.40, threshold 0.50' in listed.stdout
        assert bad.returncode == 2
        assert (lemon.returncode, lemon.stdout) == (1, '')
        assert f'Expected request {number} about lemon, got one about pear' in lemon.stderr
        assert accepted.stdout == (
            f'Request {number}, pear: the robot tries push_left (answered by Ada).\n'
        )
        assert second.returncode == 1
        assert 'was answered already: TRY_ANYWAY by Ada.' in second.stderr


@pytest.mark.graph
def test_the_keyboard(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node')
        camera = Camera(graph)
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        console = subprocess.Popen(
            [*COMMAND, '--by', 'Ada'],
            env=graph.env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert console.stdin is not None
        said = read_until(console, 'Ctrl-C ends.')
        # Typed before there is a question.
        console.stdin.write('try\n')
        console.stdin.flush()
        number = make_request(graph, camera)
        said += read_until(console, '> ')
        console.stdin.write('what?\n3\ntry\n')
        console.stdin.flush()
        outcome = graph.until(lambda: outcomes, 20, 'SKIPPED').pop()
        second = make_request(graph, camera)
        said += read_until(console, '(answered by Ada).\n') + read_until(console, '> ')
        other = run(graph, 'answer', str(second), 'done', '--by', 'Bob')
        console.stdin.write('try\n')
        console.stdin.flush()
        graph.until(lambda: outcomes, 20, 'the outcome of what Bob did')
        third = make_request(graph, camera)
        said += read_until(console, '> ')
        said += console.communicate(timeout=30)[0]

        assert other.stdout.endswith('looks whether it is LEFT (answered by Bob).\n')
        assert said.count('What was typed before this question is not taken as its answer.') == 2
        assert f'Request {second} was answered already: DONE_BY_HAND by Bob.' in said
        assert (outcome.result, outcome.decision_id) == (Outcome.SKIPPED, number)
        assert f'\n{outcome.sentence}\n' in said
        assert "Expected one of done, try, skip, got 'what?'." in said
        assert f'Request {number}, pear: skipped, push_left is not tried' in said
        assert f'No more input: request {third} stays unanswered.' in said
        assert console.returncode == 1


@pytest.mark.graph
def test_ctrl_c_ends_cleanly(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node')
        console = graph.run('console', *COMMAND)
        graph.until(lambda: 'Waiting for requests' in console.said, 20, 'the console')
        console.signal(signal.SIGINT)

        assert console.wait(10) == 0
        assert 'Bye.' in console.said
        assert 'Traceback' not in console.said


@pytest.mark.graph
def test_absent_service(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ask_human_node, 'SERVICE_TIMEOUT', 0.5)
    with domain_id() as domain:
        absent = command(ask_human_node.main, domain, 'list')

    assert absent.code == 3
    assert absent.stderr.startswith('Expected the service ask_human within 0.5 s, got none')
    assert absent.stderr.count('\n') == 1
