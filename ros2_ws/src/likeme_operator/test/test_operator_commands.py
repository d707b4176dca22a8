"""The one-shot commands of operator.sh and its line mode, on real nodes with a fake camera."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from domain_coordinator import domain_id
from fakes import Camera, make_request

from graph import HOLD_KEEPER, Graph
from in_process import command
from likeme_operator import operator_node
from likeme_operator.ros import operator_commands

COMMAND = (sys.executable, '-m', 'likeme_operator')


def run(graph: Graph, *words: str) -> subprocess.CompletedProcess[str]:
    told = subprocess.run(
        [*COMMAND, *words], env=graph.env, capture_output=True, text=True, timeout=60, check=False
    )
    assert 'Traceback' not in told.stderr
    return told


@pytest.mark.graph
def test_one_shot_commands(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start(HOLD_KEEPER)
        graph.start('likeme_inference.inference_node')
        camera = Camera(graph)
        watch = graph.run('watch', *COMMAND, 'watch', '--json')
        graph.until(lambda: 'inference_node' in watch.said, 20, 'a watch that hears the node')
        # A demonstration is told once: to the inference node and to the watch.
        told = camera._demonstrations.get_subscription_count
        graph.until(lambda: told() == 2, 20, 'a watch that hears demonstrations')
        number = make_request(graph, camera)
        graph.until(lambda: f'"id": {number}' in watch.said, 10, 'the decision')
        listed = json.loads(run(graph, 'list', '--json').stdout)['pending']
        lower = json.loads(
            run(graph, 'whatif', str(number), '--threshold', '0.4', '--json').stdout
        )
        why = run(graph, 'why', str(number))
        held = json.loads(run(graph, 'hold', '--by', 'Ada', '--json').stdout)
        resumed = json.loads(run(graph, 'resume', '--json').stdout)
        graph.until(lambda: '"resume"' in watch.said, 10, 'the resume')
        watch.signal(signal.SIGTERM)
        ended = watch.wait(10)

        assert [(q['id'], q['options']) for q in listed] == [
            (number, ['done', 'try', 'skip', 'goal'])
        ]
        trials = {row['action']: (row['successes'], row['trials']) for row in lower['evidence']}
        assert trials['PUSH_LEFT'] == (4, 10)
        kinds = {each['mode']: each['kind'] for each in lower['alternatives']}
        assert kinds['interactive'] == 'EXECUTE'
        assert lower['made']['kind'] == 'ASK_HUMAN'
        assert why.stdout.endswith('re-derived: same\n')
        assert held['held']
        assert 0 < held['confirmed_after'] < 3
        assert resumed['resumed']
        assert 'away from it at once' in resumed['moves'][0]
        events = [json.loads(line) for line in watch.said.splitlines() if line.startswith('{')]
        kinds_seen = [event['kind'] for event in events]
        assert {'node', 'demonstration', 'belief', 'decision', 'hold', 'resume'} <= {*kinds_seen}
        assert (ended, watch.said.splitlines()[-1]) == (0, 'Bye.')


@pytest.mark.graph
@pytest.mark.timeout(120)
def test_line_mode_holds_and_tells_of_a_node_that_dies_under_a_question(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start(HOLD_KEEPER)
        node = graph.start('likeme_inference.inference_node')
        camera = Camera(graph)
        desk = subprocess.Popen(
            [*COMMAND, '--plain', '--by', 'Ada'], env=graph.env, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        assert desk.stdin is not None
        assert desk.stdout is not None
        assert desk.stdout.readline().startswith('Waiting for requests')
        desk.stdin.write('hold\n')
        desk.stdin.flush()
        said = iter_until(desk, 'HELD, confirmed after')
        make_request(graph, camera)
        said += iter_until(desk, 'the robot decides anew')
        assert desk.stdout.read(2) == '> '
        node.signal(signal.SIGKILL)
        desk.stdin.write('3\n')
        desk.stdin.flush()
        said += iter_until(desk, 'Expected an answer of ask_human, got none')
        said += iter_until(desk, 'ALARM')
        graph.start('likeme_inference.inference_node')
        said += iter_until(desk, 'heard again')
        said += iter_until(desk, 'the robot decides anew')
        assert desk.stdout.read(2) == '> '
        desk.stdin.write('3\n')
        desk.stdin.flush()
        said += iter_until(desk, 'the operator skipped my question.')
        desk.send_signal(signal.SIGINT)
        said.append(desk.communicate(timeout=60)[0])
        text = ''.join(said)

        assert '`operator.sh resume` allows motion again.' in text
        assert 'the inference node is not heard: nothing is asked and no answer is taken' in text
        assert 'skipped, push_left is not tried (answered by Ada).' in text
        assert (desk.returncode, text.endswith('Bye.\n')) == (0, True)


def iter_until(desk: subprocess.Popen[str], words: str) -> list[str]:
    """Lines that a desk says, up to one with some words."""
    lines: list[str] = []
    assert desk.stdout is not None
    while not lines or words not in lines[-1]:
        lines.append(desk.stdout.readline())
        assert lines[-1], lines
    return lines


@pytest.mark.parametrize('words', [('list',), ('--plain',), ('watch', '--json')])
def test_without_a_cell_one_sentence(
    monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    monkeypatch.setattr(operator_node, 'SERVICE_TIMEOUT', 0.3)
    monkeypatch.setattr('likeme_operator.ros.watch_command.SERVICE_TIMEOUT', 0.3)
    with domain_id() as domain:
        told = command(operator_commands.main, domain, *words)
    assert told.code == 3
    assert f'ROS domain {domain}' in told.stderr
    assert told.stderr.endswith('Start it: ./scripts/start_cell.sh\n')
    assert told.stderr.count('\n') == 1


@pytest.mark.parametrize(
    ('words', 'expected'),
    [
        (('answer', '9' * 23, 'try'), 'ID'),
        (('answer', '1', 'perhaps'), 'Expected one of done, try, skip'),
        (('whatif', '--threshold', '1.5'), '--threshold'),
        (('whatif', '--mode', 'telepathy'), "got 'telepathy'"),
        (('dance',), 'dance'),
    ],
)
def test_wrong_words_are_usage_errors(words: tuple[str, ...], expected: str) -> None:
    told = command(operator_commands.main, 0, *words)
    assert (told.code, told.stdout) == (2, '')
    assert expected in told.stderr
