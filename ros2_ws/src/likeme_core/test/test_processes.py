"""Child processes: output, interruption, and the end of their parent."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import psutil
import pytest

from likeme_core.processes import interrupt, running, start

GRACE = 30.0


def python(code: str) -> list[str]:
    return [sys.executable, '-c', code]


def test_output_and_environment(tmp_path: Path) -> None:
    code = 'import os, sys; print(os.environ["WORD"]); print("error", file=sys.stderr)'
    out = tmp_path / 'out'
    with out.open('wb') as file:
        process = start(python(code), file, {'WORD': 'hello'})
        assert process.wait(GRACE) == 0
    assert sorted(out.read_text().split()) == ['error', 'hello']


def test_it_has_a_process_group_of_its_own() -> None:
    process = start(python('input()'), subprocess.PIPE)
    with process:
        assert os.getpgid(process.pid) == process.pid != os.getpgid(0)
        # Its stdin is empty: input() ends it.
        assert process.wait(GRACE) == 1


def ready(process: subprocess.Popen[bytes]) -> None:
    """Wait for the line 'ready' of a process."""
    assert process.stdout is not None
    assert process.stdout.readline() == b'ready\n'


def test_interrupt_sends_sigint() -> None:
    code = (
        'import signal, sys\n'
        'signal.signal(signal.SIGINT, lambda *_: sys.exit(7))\n'
        'print("ready", flush=True)\n'
        'signal.pause()\n'
    )
    with start(python(code), subprocess.PIPE) as process:
        ready(process)
        interrupt(process, GRACE)
        assert process.returncode == 7


def test_interrupt_kills_after_the_grace_period() -> None:
    code = (
        'import signal\n'
        'signal.signal(signal.SIGINT, signal.SIG_IGN)\n'
        'print("ready", flush=True)\n'
        'while True: signal.pause()\n'
    )
    with start(python(code), subprocess.PIPE) as process:
        ready(process)
        interrupt(process, grace=0.1)
        assert process.returncode == -signal.SIGKILL


def test_running_ends_its_process_on_an_error(tmp_path: Path) -> None:
    code = 'import signal; signal.signal(signal.SIGINT, signal.SIG_DFL); signal.pause()'
    stack = ExitStack()
    out = stack.enter_context((tmp_path / 'out').open('wb'))
    process = stack.enter_context(running(python(code), out, GRACE))
    assert process.poll() is None
    with pytest.raises(ValueError, match='inside'), stack:
        raise ValueError('inside')
    assert process.returncode is not None


def test_a_child_ends_with_its_killed_parent() -> None:
    code = (
        'import subprocess, sys\n'
        'from likeme_core.processes import start\n'
        'child = start([sys.executable, "-c", "import signal; signal.pause()"], subprocess.PIPE)\n'
        'print(child.pid, flush=True)\n'
        'child.wait()\n'
    )
    with subprocess.Popen(python(code), stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        child = psutil.Process(int(parent.stdout.readline()))
        parent.kill()
    gone, alive = psutil.wait_procs([child], timeout=GRACE)
    orphans = [p for p in alive if p.status() != psutil.STATUS_ZOMBIE]
    assert not orphans, f'{child} outlived its parent; ended: {gone}'
