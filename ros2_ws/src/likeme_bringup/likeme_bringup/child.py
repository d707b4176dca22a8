"""A process under the supervisor: what to start, how it ended, and its standby process."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import IO, NamedTuple

from likeme_core import processes, standby

#: s in which a standby process ends by itself.
LEAVE_TIME = 1.0


class Child(NamedTuple):
    """One process to run, and the prefix of its output lines."""

    name: str
    command: Sequence[str]
    # Added to the supervisor's own environment.
    environment: Mapping[str, str] = {}
    # A command that becomes this process on a line at stdin, see likeme_core.standby.
    standby: Sequence[str] | None = None


class Ended(NamedTuple):
    """How a child ended: exit code as subprocess gives it, -N for signal N."""

    name: str
    code: int
    # Why it is not started again, where it would have been.
    note: str = ''

    @property
    def message(self) -> str:
        """The end in one sentence, without its full stop."""
        if self.code < 0:
            return f'{self.name} was ended by {_signal_name(-self.code)}{self.note}'
        return f'{self.name} ended with exit code {self.code}{self.note}'


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f'signal {number}'


@dataclass
class RunningChild:
    """A started child, its pidfd, and its incomplete last line."""

    process: subprocess.Popen[bytes]
    pidfd: int
    prefix: str
    rest: bytes = b''


def start(child: Child) -> subprocess.Popen[bytes]:
    """Start a child; reads of its output do not block.

    In its own process group a child gets the terminal's Ctrl-C once, through the supervisor.
    """
    process = processes.start(child.command, subprocess.PIPE, child.environment)
    os.set_blocking(output(process).fileno(), False)
    return process


def start_standby(child: Child) -> subprocess.Popen[bytes]:
    """Start the standby process of a child."""
    assert child.standby is not None
    process = processes.start(
        child.standby, subprocess.PIPE, child.environment, stdin=subprocess.PIPE
    )
    os.set_blocking(output(process).fileno(), False)
    return process


def take_over(process: subprocess.Popen[bytes] | None) -> subprocess.Popen[bytes] | None:
    """Let a standby process become the child; None if there is none, or it has died."""
    if process is None or process.stdin is None:
        return None
    try:
        with process.stdin:
            process.stdin.write(standby.GO)
    except BrokenPipeError:
        discard(process)
        return None
    return process


def dismiss(process: subprocess.Popen[bytes]) -> None:
    """Let a standby process leave the graph and end: end its stdin."""
    if process.stdin is not None:
        process.stdin.close()


def discard(process: subprocess.Popen[bytes]) -> None:
    """Dismiss a standby process and wait until it has ended; kill it after LEAVE_TIME."""
    dismiss(process)
    with suppress(subprocess.TimeoutExpired):
        process.wait(LEAVE_TIME)
    process.kill()
    process.wait()
    if process.stdout is not None:
        process.stdout.close()


def output(process: subprocess.Popen[bytes]) -> IO[bytes]:
    """The pipe with the output of a child."""
    assert process.stdout is not None
    return process.stdout
