"""The ask_human command line and the real node: list, answer, keyboard, absent service."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from domain_coordinator import domain_id
from fakes import Arm, Camera, make_request

from graph import LATCHED, Graph
from in_process import command
from likeme_inference.console_replies import TypedAnswer, menu, read_answer
from likeme_inference.tabletop.values import Reply
from likeme_msgs.msg import Outcome
from likeme_msgs.srv import AskHuman
from likeme_operator import operator_node
from likeme_operator.ros import question_commands

COMMAND = (sys.executable, '-m', 'likeme_operator.ros.question_commands')


def run(graph: Graph, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, *arguments],
        env=graph.env,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def pending(graph: Graph) -> int:
    """The number of the oldest open question; 0: none is open."""
    listed = graph.call(AskHuman, 'ask_human', AskHuman.Request(command=0), again=2)
    return listed.pending[0].id if listed.pending else 0


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
    typed = ['1', 'done', ' D ', '2', 'try', '3', 'sk', 'goal left', ' 4  LEFT ']

    assert [read_answer(text) for text in typed] == [
        (Reply.DONE_BY_HAND, ''), (Reply.DONE_BY_HAND, ''), (Reply.DONE_BY_HAND, ''),
        (Reply.TRY_ANYWAY, ''), (Reply.TRY_ANYWAY, ''), (Reply.SKIP, ''), (Reply.SKIP, ''),
        (Reply.NAME_GOAL, 'left'), TypedAnswer(Reply.NAME_GOAL, 'LEFT'),
    ]  # fmt: skip
    for text in ('', '0', 'yes', 'doner'):
        with pytest.raises(ValueError, match='Expected one of done, try, skip, goal, got'):
            read_answer(text)
    for text, wanted in [
        ('goal', 'a region after goal'), ('try left', 'try'), ('g a b', 'a region'),
    ]:  # fmt: skip
        with pytest.raises(ValueError, match=f'Expected {wanted}.*, got {text!r}'):
            read_answer(text)


def test_the_menu_says_what_follows() -> None:
    regions = ('LEFT', 'RIGHT')
    assert menu(list(Reply), 'pear', 'LEFT', 'PUSH_LEFT', regions).splitlines() == [
        '  1  done  I did it by hand: the robot looks whether the pear is LEFT',
        '  2  try   try it anyway: the robot does PUSH_LEFT to the pear',
        '  3  skip  skip it: nothing moves',
        '  4  goal  and LEFT or RIGHT: that goal is meant, the robot decides anew',
    ]
    hopeless = [Reply.DONE_BY_HAND, Reply.SKIP]
    assert 'try' not in menu(hopeless, 'pear', 'LEFT', 'PUSH_LEFT', regions)


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
        upstairs = run(graph, 'answer', str(number), 'goal', 'upstairs')
        goal = run(graph, 'answer', str(number), 'goal', 'left', '--by', 'Ada', '--object', 'Pear')
        named = graph.until(lambda: outcomes, 10, 'an outcome').pop()
        number = graph.until(lambda: pending(graph), 10, 'the next question')
        accepted = run(graph, 'answer', str(number), 'try', '--by', 'Ada', '--object', 'Pear')
        graph.until(lambda: outcomes, 10, 'an outcome')
        second = run(graph, 'answer', str(number), 'skip', '--by', 'Bob')

        assert (empty.returncode, empty.stdout) == (0, 'Nothing is pending.\n')
        assert (nothing.returncode, nothing.stdout) == (1, '')
        assert 'Nothing is pending' in nothing.stderr
        assert f'Request {named.decision_id}: I want the pear to go from RIGHT' in listed.stdout
        assert 'best action PUSH_LEFT, p = 0.40, threshold 0.50' in listed.stdout
        assert bad.returncode == 2
        assert (lemon.returncode, lemon.stdout) == (1, '')
        assert f'Expected request {named.decision_id} about lemon, got one about' in lemon.stderr
        assert upstairs.returncode == 1
        assert 'Expected a state of chung2015' in upstairs.stderr
        assert goal.stdout == (
            f'Request {named.decision_id}, pear: wanted LEFT, the robot decides anew (answered by '
            'Ada).\n'
        )
        assert named.result == Outcome.GOAL_NAMED
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
        # Told without a key.
        said += read_until(console, 'DONE_BY_HAND.\n')
        graph.until(lambda: outcomes, 20, 'the outcome of what Bob did')
        console.stdin.write('try\n')
        console.stdin.flush()
        third = make_request(graph, camera)
        said += read_until(console, '> ')
        said += console.communicate(timeout=30)[0]

        assert other.stdout.endswith('looks whether it is LEFT (answered by Bob).\n')
        assert said.count('What was typed before this question is not taken as its answer.') == 3
        assert f'Request {second} was answered by Bob: DONE_BY_HAND.\n' in said
        assert (outcome.result, outcome.decision_id) == (Outcome.SKIPPED, number)
        assert f'\n{outcome.sentence}\n' in said
        assert "Expected one of done, try, skip, goal, got 'what?'." in said
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
    monkeypatch.setattr(operator_node, 'SERVICE_TIMEOUT', 0.5)
    with domain_id() as domain:
        absent = command(question_commands.main, domain, 'list')

    assert absent.code == 3
    assert absent.stderr.startswith('Expected the service ask_human on ROS domain')
    assert absent.stderr.count('\n') == 1
