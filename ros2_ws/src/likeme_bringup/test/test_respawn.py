"""Restarts of the supervisor: the policy by numbers, and real child processes."""

from __future__ import annotations

import io
import os
import re
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

from likeme_bringup.child import Child, Ended
from likeme_bringup.respawn import REFUSED, Lives, Respawn
from likeme_bringup.supervisor import Supervisor

BOUND = 60.0
KILLED = -signal.SIGKILL
RUNNING = """
import signal, sys, os
signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
print('up', os.getpid(), flush=True)
while True: signal.pause()
"""
#: A node's module; its import is a line of output.
MODULE = """
import os, signal, sys
print('imported', flush=True)
def main():
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    print('up', os.getpid(), *sys.argv[1:], flush=True)
    while True: signal.pause()
if __name__ == '__main__': main()
"""


def python(code: str, name: str = 'one') -> Child:
    return Child(name, [sys.executable, '-S', '-c', code])


@contextmanager
def supervised(child: Child, respawn: Respawn) -> Iterator[tuple[Supervisor, io.StringIO]]:
    out = io.StringIO()
    with Supervisor([child], out=out, grace=BOUND, respawn=respawn) as supervisor:
        yield supervisor, out


def wait_for(supervisor: Supervisor, out: io.StringIO, pattern: str) -> re.Match[str]:
    """Poll the supervisor until a pattern was printed."""
    end = time.monotonic() + BOUND
    while (found := re.search(pattern, out.getvalue())) is None:
        assert time.monotonic() < end, out.getvalue()
        assert supervisor.watch(0.05) is None
    return found


def test_pauses_grow_and_end() -> None:
    lives = Lives(Respawn(pauses=(0.0, 0.5, 1.0), stable=30.0))
    lives.start(0.0)
    assert [lives.death(KILLED, t) for t in (1.0, 2.0, 3.0, 4.0)] == [0.0, 0.5, 1.0, None]
    assert lives.exhausted == ', death 4 in a row within 30 s of a start'


def test_a_stable_life_sets_the_pauses_back() -> None:
    lives = Lives(Respawn(pauses=(0.0, 0.5), stable=30.0))
    for start, death, pause in ((0.0, 1.0, 0.0), (1.0, 2.0, 0.5), (2.0, 32.0, 0.0)):
        lives.start(start)
        assert lives.death(1, death) == pause
    assert lives.restarts == 3
    assert lives.exhausted == ''


def test_what_was_told_to_stop_stays_stopped() -> None:
    assert Lives(Respawn()).death(0, 1.0) is None


def test_a_refusal_is_final_at_the_first_start_only() -> None:
    lives = Lives(Respawn())
    assert lives.death(REFUSED, 1.0) is None
    assert lives.death(KILLED, 2.0) is not None
    assert lives.death(REFUSED, 3.0) is not None


def test_a_killed_child_is_started_again() -> None:
    with supervised(python(RUNNING), Respawn()) as (supervisor, out):
        first = int(wait_for(supervisor, out, r'up (\d+)')[1])
        os.kill(first, signal.SIGKILL)
        second = int(wait_for(supervisor, out, r'up .*\n(?:.*\n)*one  *\| up (\d+)')[1])
        assert second != first
        assert (
            'cell | one was ended by SIGKILL; starting it again now (restart 1).\n'
            in out.getvalue()
        )
        assert supervisor.stop() == [Ended('one', 0)]


def test_too_many_deaths_end_all() -> None:
    out = io.StringIO()
    children = [python('import sys; sys.exit(3)'), python(RUNNING, 'two')]
    respawn = Respawn(pauses=(0.0, 0.01))
    assert Supervisor(children, out=out, grace=BOUND, respawn=respawn).run() == 1
    said = [line for line in out.getvalue().splitlines() if line.startswith('cell')]
    assert said == [
        'cell | one ended with exit code 3; starting it again now (restart 1).',
        'cell | one ended with exit code 3; starting it again in 0.01 s (restart 2).',
        'cell | one ended with exit code 3, death 3 in a row within 30 s of a start; ending the '
        'others.',
    ]


@pytest.mark.parametrize('code', [0, REFUSED])
def test_an_end_that_is_no_death_ends_all(code: int) -> None:
    out = io.StringIO()
    child = python(f'import sys; sys.exit({code})')
    assert Supervisor([child], out=out, respawn=Respawn()).run() == 1
    assert out.getvalue() == f'cell | one ended with exit code {code}; ending the others.\n'


def test_stop_in_a_pause_starts_nothing_more() -> None:
    with supervised(python('raise SystemExit(3)'), Respawn(pauses=(1.0,))) as (supervisor, out):
        wait_for(supervisor, out, 'starting it again in 1 s')
        supervisor.stop()
        assert supervisor.watch(BOUND) is None


def test_a_child_that_fails_when_it_is_stopped_is_not_started_again() -> None:
    code = RUNNING.replace('sys.exit(0)', 'sys.exit(3)')
    with supervised(python(code), Respawn()) as (supervisor, out):
        wait_for(supervisor, out, 'up')
        assert supervisor.stop() == [Ended('one', 3)]
    assert 'starting it again' not in out.getvalue()


def test_a_program_that_is_gone_counts_as_a_death(tmp_path: Path) -> None:
    program = tmp_path / 'program'
    program.write_text('#!/bin/sh\nrm "$0"\nexit 3\n')
    program.chmod(0o755)
    out = io.StringIO()
    child = Child('one', [str(program)])
    assert Supervisor([child], out=out, respawn=Respawn(pauses=(0.0,))).run() == 1
    assert 'one cannot be started: No such file or directory.' in out.getvalue()
    assert 'death 2 in a row' in out.getvalue()


@pytest.fixture
def node(tmp_path: Path) -> Child:
    """A module with a `main`, with a standby."""
    import likeme_core

    (tmp_path / 'tiny_node.py').write_text(MODULE)
    roots = (str(tmp_path), str(Path(likeme_core.__file__).parents[1]))
    words = ['tiny_node', '--seed', '3']
    return Child(
        'one',
        [sys.executable, '-S', '-m', *words],
        {'PYTHONPATH': os.pathsep.join(roots)},
        [sys.executable, '-S', '-m', 'likeme_core.standby', *words],
    )


def standbys() -> list[psutil.Process]:
    return [child for child in psutil.Process().children() if child.name() == 'standby']


def test_a_standby_becomes_the_child(node: Child) -> None:
    with supervised(node, Respawn(standby=0.0)) as (supervisor, out):
        first = int(wait_for(supervisor, out, r'up (\d+) --seed 3\n')[1])
        while not (waiting := standbys()):
            assert supervisor.watch(0.05) is None
        # Its imports are silent, and happened before.
        os.kill(first, signal.SIGKILL)
        second = int(wait_for(supervisor, out, r'restart 1\)\.\none  *\| up (\d+) --seed 3\n')[1])
        assert second == waiting[0].pid
        while not (waiting := standbys()):
            assert supervisor.watch(0.05) is None
        assert supervisor.stop() == [Ended('one', 0)]
        assert not waiting[0].is_running()


NETWORK_COMES = """
import sys
from likeme_core import standby
networks = iter([frozenset(), frozenset({('eth0', '192.0.2.1')})])
standby.running_networks = lambda: next(networks)
sys.exit(standby.main(*sys.argv[1:]))
"""


def test_a_standby_starts_anew_where_the_network_came_after_it(node: Child) -> None:
    assert node.standby is not None
    changed = [sys.executable, '-c', NETWORK_COMES, *node.standby[4:]]
    child = node._replace(standby=changed)
    with supervised(child, Respawn(standby=0.0)) as (supervisor, out):
        first = int(wait_for(supervisor, out, r'up (\d+)')[1])
        while not (waiting := standbys()):
            assert supervisor.watch(0.05) is None
        os.kill(first, signal.SIGKILL)
        again = r'restart 1\)\.\none  *\| imported\none  *\| up (\d+) --seed 3\n'
        assert int(wait_for(supervisor, out, again)[1]) == waiting[0].pid
        assert supervisor.stop() == [Ended('one', 0)]


def test_without_its_standby_a_child_is_started_from_nothing(node: Child) -> None:
    with supervised(node, Respawn(standby=0.0)) as (supervisor, out):
        first = int(wait_for(supervisor, out, r'up (\d+)')[1])
        while not (waiting := standbys()):
            assert supervisor.watch(0.05) is None
        waiting[0].kill()
        waiting[0].wait()
        os.kill(first, signal.SIGKILL)
        wait_for(supervisor, out, r'restart 1\)\.\none  *\| imported\none  *\| up')


def test_a_standby_ends_with_its_pipe(node: Child) -> None:
    assert node.standby is not None
    import subprocess

    done = subprocess.run(
        node.standby, env=os.environ | dict(node.environment), stdin=subprocess.DEVNULL,
        capture_output=True, timeout=BOUND, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, b'', b'')
