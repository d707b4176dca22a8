"""Processes that end with the one that starts them.

Linux only: PR_SET_PDEATHSIG, so that not even `kill -9` of the parent leaves an orphan.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import IO

PR_SET_PDEATHSIG = 1
# Loaded before any fork: importing between fork and exec is not safe.
_LIBC = ctypes.CDLL(None, use_errno=True)


def die_with_parent(parent: int) -> Callable[[], None]:
    """A `preexec_fn` that has the kernel kill the child when process `parent` dies.

    SIGKILL, because then nobody is left who could insist. The death of the *thread* that forks
    counts: start children from a thread that lives as long as they should.
    """

    def before_exec() -> None:
        _LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        # The parent may have died before the line above: nothing would tell us any more.
        if os.getppid() != parent:
            os._exit(1)

    return before_exec


def start(
    command: Sequence[str], out: int | IO[bytes], environment: Mapping[str, str] | None = None
) -> subprocess.Popen[bytes]:
    """Start a process without input, all it says in `out`.

    It has a group of its own: the terminal's Ctrl-C is for this process, which then ends it by
    SIGINT. That one is not inherited ignored, as it is in a background job of a script.
    environment: added to this process's own.
    """
    follow_parent = die_with_parent(os.getpid())

    def before_exec() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        follow_parent()

    return subprocess.Popen(
        command,
        env=os.environ | dict(environment or {}),
        stdin=subprocess.DEVNULL,
        stdout=out,
        stderr=subprocess.STDOUT,
        process_group=0,
        preexec_fn=before_exec,
    )


def interrupt(process: subprocess.Popen[bytes], grace: float) -> None:
    """Have a process end by SIGINT, or by SIGKILL after `grace` s; returns when it has."""
    process.send_signal(signal.SIGINT)
    try:
        process.wait(grace)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


@contextmanager
def running(
    command: Sequence[str],
    out: IO[bytes],
    grace: float,
    environment: Mapping[str, str] | None = None,
) -> Iterator[subprocess.Popen[bytes]]:
    """A process as by `start` that is interrupted at the end."""
    process = start(command, out, environment)
    try:
        yield process
    finally:
        interrupt(process, grace)
