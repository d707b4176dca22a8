"""Child processes that end with their parent.

Linux only: PR_SET_PDEATHSIG, so that `kill -9` of the parent leaves no orphan either.
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
# Loaded before any fork, as importing between fork and exec is not safe.
_LIBC = ctypes.CDLL(None, use_errno=True)


def die_with_parent(parent: int) -> Callable[[], None]:
    """A `preexec_fn` by which the kernel sends SIGKILL to the child when its parent dies.

    The signal is sent when the *thread* that forks ends: start children from a thread that lives
    as long as they should.

    Args:
        parent: process ID.
    """

    def before_exec() -> None:
        _LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        # The parent may have died before the call, which then has no effect.
        if os.getppid() != parent:
            os._exit(1)

    return before_exec


def start(
    command: Sequence[str],
    out: int | IO[bytes],
    environment: Mapping[str, str] | None = None,
    stdin: int = subprocess.DEVNULL,
) -> subprocess.Popen[bytes]:
    """Start a process, without stdin unless told otherwise, with stdout and stderr in `out`.

    It has its own process group, so that Ctrl-C reaches this process alone, which then ends it by
    SIGINT. SIGINT is not inherited as ignored, as it is in a background job of a script.
    environment: added to that of this process.
    """
    follow_parent = die_with_parent(os.getpid())

    def before_exec() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        follow_parent()

    return subprocess.Popen(
        command,
        env=os.environ | dict(environment or {}),
        stdin=stdin,
        stdout=out,
        stderr=subprocess.STDOUT,
        process_group=0,
        preexec_fn=before_exec,
    )


def interrupt(process: subprocess.Popen[bytes], grace: float) -> None:
    """End a process by SIGINT, or by SIGKILL after a grace period (s), and wait for it."""
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
    """Context of a process from `start`, ended by `interrupt`."""
    process = start(command, out, environment)
    try:
        yield process
    finally:
        interrupt(process, grace)
