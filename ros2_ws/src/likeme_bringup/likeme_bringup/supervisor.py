"""Runs several processes as one: what dies is started again, and none outlives the supervisor.

Linux only: the end of a process is noticed by its pidfd.
"""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from types import FrameType
from typing import TextIO

from likeme_bringup.child import (
    Child,
    Ended,
    RunningChild,
    discard,
    dismiss,
    output,
    start,
    start_standby,
    take_over,
)
from likeme_bringup.respawn import Lives, Respawn
from likeme_core.shared_memory import remove_orphans

COLOURS = ('36', '33', '35', '32', '34', '31')


class Supervisor:
    """Starts children, forwards their output with a prefix, and ends them.

    `start`, then `watch` as often as wanted, then `stop`; or `run`, which does all three until a
    child ends or SIGINT, SIGTERM or SIGHUP comes. Also a context manager (start ... stop).

    With a `respawn` policy a child that died is started again; then "ends" means an end that the
    policy does not mend: exit code 0, refused parameters, too many deaths in a row.

    SIGINT counts also in a background job of a script, which inherits it ignored; SIGHUP does not
    where it is inherited ignored, as under nohup.
    """

    def __init__(
        self,
        children: Sequence[Child],
        out: TextIO | None = None,
        grace: float = 5.0,
        respawn: Respawn | None = None,
    ) -> None:
        """`grace`: seconds a child has after SIGINT, and again after SIGTERM, before SIGKILL.

        `respawn`: None: no child is started again.
        """
        self.children = tuple(children)
        self.grace = grace
        self._respawn = respawn
        self._lives = {child.name: Lives(respawn) for child in children if respawn is not None}
        self._stopping = False
        # Times at which something is to be started, of the monotonic clock, by child.
        self._restart_at: dict[str, float] = {}
        self._standby_at: dict[str, float] = {}
        self._standbys: dict[str, subprocess.Popen[bytes]] = {}
        self._out = sys.stdout if out is None else out
        self._colour = self._out.isatty()
        self._running: dict[str, RunningChild] = {}
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
        self._stopping = False
        try:
            for child in self.children:
                self._start(child)
        except OSError:
            self.stop()
            raise

    def watch(self, timeout: float | None = None) -> Ended | None:
        """Forward output until a child ended (return it) or `timeout` seconds passed (None)."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self._ended and self._alive:
            left = None if deadline is None else deadline - time.monotonic()
            if left is not None and left < 0:
                return None
            self._poll(left)
        return self._ended.pop(0) if self._ended else None

    def stop(self) -> list[Ended]:
        """End all: SIGINT, after `grace` seconds SIGTERM, then SIGKILL; return the ends."""
        self._stopping = True
        self._restart_at.clear()
        self._standby_at.clear()
        for waiting in self._standbys.values():
            dismiss(waiting)
        for step in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            if self._running and step != signal.SIGINT:
                names = ' and '.join(self._running)
                self.log(f'{names} did not end within {self.grace:g} s: sending {step.name}.')
            for child in self._running.values():
                child.process.send_signal(step)
            deadline = time.monotonic() + self.grace
            while self._running and (left := deadline - time.monotonic()) > 0:
                self._poll(left)
        while self._standbys:
            discard(self._standbys.popitem()[1])
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
            while end is None and not asked and self._alive:
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

    @property
    def _alive(self) -> bool:
        """Whether a child runs or is about to."""
        return bool(self._running or self._restart_at)

    def _start(self, child: Child) -> None:
        """Start a child by its standby, if it has one, or else by its command."""
        now = time.monotonic()
        process = take_over(self._standbys.pop(child.name, None)) or start(child)
        pidfd = os.pidfd_open(process.pid)
        self._running[child.name] = RunningChild(process, pidfd, self._prefix(child))
        self._selector.register(output(process), selectors.EVENT_READ, child.name)
        self._selector.register(pidfd, selectors.EVENT_READ, child.name)
        if self._respawn is not None:
            self._lives[child.name].start(now)
            if child.standby is not None and self._respawn.standby is not None:
                self._standby_at[child.name] = now + self._respawn.standby

    def _prefix(self, child: Child) -> str:
        label = child.name.ljust(max(len(each.name) for each in self.children))
        colour = COLOURS[self.children.index(child) % len(COLOURS)]
        return f'\033[{colour}m{label}\033[0m' if self._colour else label

    def _poll(self, timeout: float | None) -> None:
        """Wait once, forward output, remove the children that have ended, start what is due."""
        due = (*self._restart_at.values(), *self._standby_at.values())
        if due:
            until = max(0.0, min(due) - time.monotonic())
            timeout = until if timeout is None else min(timeout, until)
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
        self._start_due(time.monotonic())

    def _start_due(self, now: float) -> None:
        for child in self.children:
            if self._restart_at.get(child.name, now + 1) <= now:
                del self._restart_at[child.name]
                try:
                    self._start(child)
                except OSError as error:
                    self.log(f'{child.name} cannot be started: {error.strerror}.')
                    self._died(Ended(child.name, os.EX_OSERR))
            if self._standby_at.get(child.name, now + 1) <= now:
                del self._standby_at[child.name]
                try:
                    self._standbys[child.name] = start_standby(child)
                except OSError as error:
                    self.log(f'{child.name} has no standby process: {error.strerror}.')

    def _forward(self, child: RunningChild) -> bool:
        """Write the complete lines of a child; return whether its output is still open."""
        while chunk := output(child.process).read(65536):
            *lines, child.rest = (child.rest + chunk).split(b'\n')
            for line in lines:
                self._line(child.prefix, line)
        return chunk is None

    def _remove(self, name: str, child: RunningChild) -> None:
        if child.rest:
            self._line(child.prefix, child.rest)
        stdout = output(child.process)
        for source in (stdout, child.pidfd):
            if source in self._selector.get_map():
                self._selector.unregister(source)
        stdout.close()
        os.close(child.pidfd)
        del self._running[name]
        self._died(Ended(name, child.process.wait()))

    def _died(self, end: Ended) -> None:
        """Have a child started again, or report its end."""
        now = time.monotonic()
        self._standby_at.pop(end.name, None)
        if end.code == -signal.SIGKILL:
            remove_orphans()
        if self._stopping or self._respawn is None:
            self._ended.append(end)
            return
        lives = self._lives[end.name]
        pause = lives.death(end.code, now)
        if pause is None:
            self._ended.append(end._replace(note=lives.exhausted))
            return
        when = f'in {pause:g} s' if pause else 'now'
        self.log(f'{end.message}; starting it again {when} (restart {lives.restarts}).')
        self._restart_at[end.name] = now + pause

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
