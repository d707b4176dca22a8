"""The supervisor with real child processes; every wait is on a pipe or a process, with a bound."""

from __future__ import annotations

import io
import os
import re
import select
import signal
import subprocess
import sys
import textwrap
import threading
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from likeme_bringup.child import Child, Ended
from likeme_bringup.supervisor import Supervisor
from likeme_core import processes

BOUND = 60.0
# Prints its pid, then sleeps; SIGINT ends it with exit code 0.
RUNNING = """
import signal, sys, os
signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
print('up', os.getpid(), flush=True)
while True: signal.pause()
"""
STUBBORN = """
import signal, os
signal.signal(signal.SIGINT, signal.SIG_IGN); signal.signal(signal.SIGTERM, signal.SIG_IGN)
print('up', os.getpid(), flush=True)
while True: signal.pause()
"""
HANDLER = 'import signal; print(signal.getsignal(signal.SIGINT).__name__)'


def python(name: str, code: str) -> Child:
    return Child(name, [sys.executable, '-S', '-c', textwrap.dedent(code)])


def wait_for(supervisor: Supervisor, out: io.StringIO, words: str) -> None:
    """Poll the supervisor until `words` were printed."""
    for _ in range(200):
        if words in out.getvalue():
            return
        assert supervisor.watch(BOUND / 200) is None
    raise AssertionError(f'expected "{words}", got "{out.getvalue()}"')


def gone(pid: int) -> bool:
    """Whether a process has ended within the bound (its pidfd becomes readable)."""
    try:
        pidfd = os.pidfd_open(pid)
    except ProcessLookupError:
        return True
    try:
        return bool(select.select([pidfd], [], [], BOUND)[0])
    finally:
        os.close(pidfd)


def test_lines_carry_the_name_of_their_child() -> None:
    out = io.StringIO()
    supervisor = Supervisor([python('one', 'print("hello"); print("rest", end="")')], out=out)
    supervisor.start()
    assert supervisor.watch(BOUND) == Ended('one', 0)
    assert out.getvalue() == 'one | hello\none | rest\n'


def test_when_one_ends_the_others_are_ended() -> None:
    out = io.StringIO()
    children = [python('stays', RUNNING), python('dies', 'import sys; sys.exit(3)')]
    assert Supervisor(children, out=out, grace=BOUND).run() == 1
    assert 'dies ended with exit code 3; ending the others.' in out.getvalue()


def test_an_end_by_a_signal_is_named() -> None:
    assert Ended('arm', -signal.SIGSEGV).message == 'arm was ended by SIGSEGV'


def test_a_child_that_cannot_start_ends_the_others() -> None:
    before = psutil.Process().children()
    supervisor = Supervisor(
        [python('stays', RUNNING), Child('absent', ['/no/such/program'])], out=io.StringIO()
    )
    with pytest.raises(FileNotFoundError):
        supervisor.start()
    assert psutil.Process().children() == before


def test_stop_sends_sigint_first() -> None:
    out = io.StringIO()
    supervisor = Supervisor([python('one', RUNNING), python('two', RUNNING)], out=out, grace=BOUND)
    with supervisor:
        wait_for(supervisor, out, 'one | up')
        wait_for(supervisor, out, 'two | up')
        assert sorted(supervisor.stop()) == [Ended('one', 0), Ended('two', 0)]


class Late(Supervisor):
    """Looks only once all children have ended, from when it is told to."""

    late = False

    def _poll(self, timeout: float | None) -> None:
        for child in self._running.values() if self.late else ():
            os.waitid(os.P_PID, child.process.pid, os.WEXITED | os.WNOWAIT)
        super()._poll(timeout)


def test_children_that_end_at_the_same_time_are_all_reported() -> None:
    out = io.StringIO()
    children = [python('one', RUNNING), python('two', RUNNING)]
    with Late(children, out=out, grace=BOUND) as supervisor:
        wait_for(supervisor, out, 'one | up')
        wait_for(supervisor, out, 'two | up')
        supervisor.late = True
        assert sorted(supervisor.stop()) == [Ended('one', 0), Ended('two', 0)]


def test_a_child_that_ignores_signals_is_killed() -> None:
    out = io.StringIO()
    supervisor = Supervisor([python('mule', STUBBORN)], out=out, grace=0.2)
    with supervisor:
        wait_for(supervisor, out, 'up')
        assert supervisor.stop() == [Ended('mule', -signal.SIGKILL)]
    assert 'mule did not end within 0.2 s: sending SIGTERM.' in out.getvalue()
    assert 'sending SIGKILL.' in out.getvalue()


def test_watch_returns_none_when_nothing_ended() -> None:
    out = io.StringIO()
    with Supervisor([python('one', RUNNING)], out=out, grace=BOUND) as supervisor:
        wait_for(supervisor, out, 'up')
        assert supervisor.watch(0.0) is None


RUNNER = """
import sys
from likeme_bringup.child import Child
from likeme_bringup.supervisor import Supervisor
code = sys.argv[1]
children = [Child(name, [sys.executable, '-S', '-c', code]) for name in ('one', 'two')]
sys.exit(Supervisor(children, grace=20).run())
"""


@pytest.fixture(params=[()])
def running(request: pytest.FixtureRequest) -> Iterator[tuple[subprocess.Popen[str], list[int]]]:
    """A supervisor process with two children that have printed their pids.

    The parameter: signals that it inherits ignored.
    """
    import likeme_bringup
    import likeme_core

    roots = [str(Path(each.__file__).parents[1]) for each in (likeme_bringup, likeme_core)]
    environment = os.environ | {'PYTHONPATH': os.pathsep.join(roots)}

    def inherit() -> None:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN if number in request.param else signal.SIG_DFL)

    process = subprocess.Popen(
        [sys.executable, '-S', '-c', RUNNER, RUNNING],
        preexec_fn=inherit,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
        start_new_session=True,
    )
    guard = threading.Timer(BOUND, process.kill)
    guard.start()
    assert process.stdout is not None
    try:
        pids = [int(process.stdout.readline().rsplit(' ', 1)[1]) for _ in range(2)]
        yield process, pids
    finally:
        guard.cancel()
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_all_cleanly(
    running: tuple[subprocess.Popen[str], list[int]], number: signal.Signals
) -> None:
    process, pids = running
    # To the whole group, as a terminal's Ctrl-C does.
    os.killpg(process.pid, number)
    assert process.wait(BOUND) == 0
    assert all(gone(pid) for pid in pids)


def ignored(pid: int) -> set[signal.Signals]:
    """The signals that a process ignores."""
    line = re.search(r'SigIgn:\s+(\w+)', Path(f'/proc/{pid}/status').read_text())
    assert line is not None
    mask = int(line[1], 16)
    return {number for number in signal.Signals if mask >> (number - 1) & 1}


@pytest.mark.parametrize('running', [(signal.SIGINT, signal.SIGHUP)], indirect=True)
def test_inherited_ignored_sigint_ends_all_and_sighup_nothing(
    running: tuple[subprocess.Popen[str], list[int]],
) -> None:
    process, pids = running
    assert ignored(process.pid) & {signal.SIGINT, signal.SIGHUP} == {signal.SIGHUP}
    assert all(signal.SIGINT not in ignored(pid) for pid in pids)
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(BOUND) == 0
    assert all(gone(pid) for pid in pids)


def test_a_child_of_a_background_job_can_be_interrupted() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        child = processes.start([sys.executable, '-S', '-c', HANDLER], subprocess.PIPE)
    finally:
        signal.signal(signal.SIGINT, before)
    assert child.communicate(timeout=BOUND)[0] == b'default_int_handler\n'


def test_kill_9_of_the_supervisor_leaves_no_orphan(
    running: tuple[subprocess.Popen[str], list[int]],
) -> None:
    process, pids = running
    process.kill()
    assert all(gone(pid) for pid in pids)
