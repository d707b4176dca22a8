"""A program that is run by likeme_core.program ends in one line at SIGINT, wherever it is."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import likeme_core

ROOT = Path(likeme_core.__file__).parents[1]
#: Says where it is, then waits for a signal, or for the end of this process.
WAIT = "import os\nos.write(1, b'{}')\nos.read(0, 1)\n"
PROGRAM = """
import sys


def main():
    print(sys.argv)
    return 7


def fail():
    raise KeyboardInterrupt
"""


def run(folder: Path, *words: str, blocked: bool = False) -> subprocess.Popen[str]:
    prefix = ['env', '--block-signal=INT'] if blocked else []
    return subprocess.Popen(
        [*prefix, sys.executable, '-m', 'likeme_core.program', 'name', *words],
        env=os.environ | {'PYTHONPATH': f'{folder}{os.pathsep}{ROOT}'},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize('blocked', [False, True])
@pytest.mark.parametrize('where', ['import', 'main'])
def test_a_signal_ends_it_in_one_line(tmp_path: Path, where: str, blocked: bool) -> None:
    waits = WAIT.format(where)
    body = waits if where == 'import' else f'def main():\n    {waits.replace(chr(10), "; ")}pass\n'
    (tmp_path / 'slow.py').write_text(body)
    process = run(tmp_path, 'slow', blocked=blocked)
    assert process.stdout is not None
    assert process.stdout.read(len(where)) == where
    process.send_signal(signal.SIGINT)
    said, errors = process.communicate(timeout=20)
    assert (said, errors, process.returncode) == ('', 'Interrupted.\n', 130)


def test_a_signal_that_came_while_it_was_blocked_ends_it(tmp_path: Path) -> None:
    (tmp_path / 'tiny.py').write_text(PROGRAM)
    before = {signal.SIGINT}
    signal.pthread_sigmask(signal.SIG_BLOCK, before)
    try:
        process = run(tmp_path, 'tiny')
        process.send_signal(signal.SIGINT)
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, before)
    said, errors = process.communicate(timeout=20)
    assert (said, errors, process.returncode) == ('', 'Interrupted.\n', 130)


def test_it_passes_arguments_and_exit_code(tmp_path: Path) -> None:
    (tmp_path / 'tiny.py').write_text(PROGRAM)
    for program in ('tiny', 'tiny:main', f'{tmp_path}/tiny.py'):
        process = run(tmp_path, program, '-x')
        said, errors = process.communicate(timeout=20)
        assert (said, errors, process.returncode) == ("['name', '-x']\n", '', 7)


def test_an_interrupt_that_the_program_raises_is_one_line_too(tmp_path: Path) -> None:
    (tmp_path / 'tiny.py').write_text(PROGRAM)
    process = run(tmp_path, 'tiny:fail')
    assert process.communicate(timeout=20) == ('', 'Interrupted.\n')
    assert process.returncode == 130
