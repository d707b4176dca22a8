"""Runs several processes as one: when one ends all are ended, and none outlives the supervisor.

Linux only: the end of a process is noticed by its pidfd.
"""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import FrameType
from typing import NamedTuple, TextIO

from likeme_core import processes

COLOURS = ('36', '33', '35', '32', '34', '31')


class Child(NamedTuple):
    """One process to run, and the prefix of its output lines."""

    name: str
    command: Sequence[str]
    # Added to the supervisor's own environment.
    environment: Mapping[str, str] = {}


class Ended(NamedTuple):
    """How a child ended: exit code as subprocess gives it, -N for signal N."""

    name: str
    code: int

    @property
    def message(self) -> str:
        """The end in one sentence."""
        if self.code < 0:
            return f'{self.name} was ended by {signal.Signals(-self.code).name}'
        return f'{self.name} ended with exit code {self.code}'


@dataclass
class _Running:
    """A started child, its pidfd, and its incomplete last line."""

    process: subprocess.Popen[bytes]
    pidfd: int
    prefix: str
    rest: bytes = b''


class Supervisor:
    """Starts children, forwards their output with a prefix, and ends them.

    `start`, then `watch` as often as wanted, then `stop`; or `run`, which does all three until a
    child ends or SIGINT, SIGTERM or SIGHUP comes. Also a context manager (start ... stop).

    SIGINT counts also in a background job of a script, which inherits it ignored; SIGHUP does not
    where it is inherited ignored, as under nohup.
    """

    def __init__(
        self,
        children: Sequence[Child],
        out: TextIO | None = None,
        grace: float = 5.0,
    ) -> None:
        """`grace`: seconds a child has after SIGINT, and again after SIGTERM, before SIGKILL."""
        self.children = tuple(children)
        self.grace = grace
        self._out = sys.stdout if out is None else out
        self._colour = self._out.isatty()
        self._running: dict[str, _Running] = {}
        self._selector = selectors.DefaultSelector()
        self._ended: list[Ended] = []

    def __enter__(self) -> Supervisor:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def log(self, message: str) -> None:
        """Print a line of the supervisor itself."""
        self._write('cell', message, '1')

    def start(self) -> None:
        """Start every child; when one cannot be started, end the others and raise OSError."""
        width = max(len(child.name) for child in self.children)
        try:
            for number, child in enumerate(self.children):
                self._start(child, child.name.ljust(width), COLOURS[number % len(COLOURS)])
        except OSError:
            self.stop()
            raise

    def watch(self, timeout: float | None = None) -> Ended | None:
        """Forward output until a child ended (return it) or `timeout` seconds passed (None)."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self._ended and self._running:
            left = None if deadline is None else deadline - time.monotonic()
            if left is not None and left < 0:
                return None
            self._poll(left)
        return self._ended.pop(0) if self._ended else None

    def stop(self) -> list[Ended]:
        """End all: SIGINT, after `grace` seconds SIGTERM, then SIGKILL; return the ends."""
        for step in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            if self._running and step != signal.SIGINT:
                names = ' and '.join(self._running)
                self.log(f'{names} did not end within {self.grace:g} s: sending {step.name}.')
            for child in self._running.values():
                child.process.send_signal(step)
            deadline = time.monotonic() + self.grace
            while self._running and (left := deadline - time.monotonic()) > 0:
                self._poll(left)
        # Several may have ended in one poll.
        ends, self._ended = self._ended, []
        return ends

    def run(self) -> int:
        """Run until a child ends (1) or a signal comes (0; 1 if a child had to be killed)."""
        asked: list[int] = []
        wake_read, wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)

        def on_signal(number: int, _: FrameType | None) -> None:
            asked.append(number)

        watched = [signal.SIGINT, signal.SIGTERM]
        if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
            watched.append(signal.SIGHUP)
        before = {number: signal.signal(number, on_signal) for number in watched}
        # select() is restarted after a handler (PEP 475): a byte in this pipe ends its wait.
        old_wake = signal.set_wakeup_fd(wake_write, warn_on_full_buffer=False)
        self._selector.register(wake_read, selectors.EVENT_READ, None)
        try:
            self.start()
            end: Ended | None = None
            while end is None and not asked and self._running:
                self._poll(None)
                end = self._ended.pop(0) if self._ended else None
            if end is not None:
                self.log(f'{end.message}; ending the others.')
            killed = [e for e in self.stop() if e.code == -signal.SIGKILL]
            return 1 if end is not None or killed else 0
        finally:
            self.stop()
            self._selector.unregister(wake_read)
            signal.set_wakeup_fd(old_wake)
            for number, handler in before.items():
                signal.signal(number, handler)
            os.close(wake_read)
            os.close(wake_write)

    def _start(self, child: Child, label: str, colour: str) -> None:
        # In its own process group a child gets the terminal's Ctrl-C once, through `stop`.
        process = processes.start(child.command, subprocess.PIPE, child.environment)
        assert process.stdout is not None
        os.set_blocking(process.stdout.fileno(), False)
        pidfd = os.pidfd_open(process.pid)
        prefix = f'\033[{colour}m{label}\033[0m' if self._colour else label
        self._running[child.name] = _Running(process, pidfd, prefix)
        self._selector.register(process.stdout, selectors.EVENT_READ, child.name)
        self._selector.register(pidfd, selectors.EVENT_READ, child.name)

    def _poll(self, timeout: float | None) -> None:
        """Wait once, forward output, and remove the children that have ended."""
        for key, _ in self._selector.select(timeout):
            if key.data is None:
                os.read(key.fd, 512)
            elif key.data in self._running:
                child = self._running[key.data]
                still_open = self._forward(child)
                if key.fd == child.pidfd:
                    self._remove(key.data, child)
                elif not still_open:
                    self._selector.unregister(key.fileobj)

    def _forward(self, child: _Running) -> bool:
        """Write the complete lines of a child; return whether its output is still open."""
        assert child.process.stdout is not None
        while chunk := child.process.stdout.read(65536):
            *lines, child.rest = (child.rest + chunk).split(b'\n')
            for line in lines:
                self._line(child.prefix, line)
        return chunk is None

    def _remove(self, name: str, child: _Running) -> None:
        assert child.process.stdout is not None
        if child.rest:
            self._line(child.prefix, child.rest)
        for source in (child.process.stdout, child.pidfd):
            if source in self._selector.get_map():
                self._selector.unregister(source)
        child.process.stdout.close()
        os.close(child.pidfd)
        del self._running[name]
        self._ended.append(Ended(name, child.process.wait()))

    def _write(self, label: str, sentence: str, colour: str) -> None:
        prefix = f'\033[{colour}m{label}\033[0m' if self._colour else label
        self._line(prefix, sentence.encode())

    def _line(self, prefix: str, line: bytes) -> None:
        try:
            self._out.write(f'{prefix} | {line.decode(errors="replace")}\n')
            self._out.flush()
        except BrokenPipeError:
            # The reader of the output has ended (`start_cell.sh | head`): discard the rest.
            self._out = open(os.devnull, 'w', encoding='utf-8')  # noqa: SIM115
