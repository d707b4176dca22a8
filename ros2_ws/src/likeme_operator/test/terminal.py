"""A program in a pseudo-terminal whose screen a test reads."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import termios
import time
from collections.abc import Callable, Mapping, Sequence

import pyte

from graph import SLACK
from likeme_core.processes import die_with_parent

#: Keys by their names in the handbook.
KEYS = {'Up': '\x1b[A', 'Down': '\x1b[B', 'Enter': '\r', 'Esc': '\x1b', 'SPACE': ' '}


class Terminal:
    """A pseudo-terminal with a program.

    Attributes:
        process: the program.
        screen: what a person sees. bells: how often it rang.
        raw: all that was written.
    """

    def __init__(
        self,
        command: Sequence[str],
        env: Mapping[str, str],
        columns: int = 80,
        lines: int = 24,
        meanwhile: Callable[[], object] = lambda: None,
    ) -> None:
        """meanwhile: called again and again while `until` waits."""
        self._meanwhile = meanwhile
        self.screen = pyte.Screen(columns, lines)
        self.screen.write_process_input = lambda data: None
        self._stream = pyte.ByteStream(self.screen)
        self.raw = b''
        self.master, slave = pty.openpty()
        self._slave = slave
        self.resize(columns, lines, tell=False)
        self.before = termios.tcgetattr(slave)

        def before_exec() -> None:
            os.setsid()
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)
            die_with_parent(parent)()

        parent = os.getpid()
        self.process = subprocess.Popen(
            list(command),
            # A shell's own width does not keep the screen from following the terminal's.
            env={**env, 'TERM': 'xterm-256color', 'COLORTERM': 'truecolor', 'COLUMNS': '80'},
            stdin=slave,
            stdout=slave,
            stderr=slave,
            preexec_fn=before_exec,
        )

    @property
    def text(self) -> str:
        """The screen as lines."""
        return '\n'.join(self.screen.display)

    @property
    def bells(self) -> int:
        """How often the bell rang."""
        return self.raw.count(b'\x07')

    def resize(self, columns: int, lines: int, tell: bool = True) -> None:
        """Give the terminal another size."""
        fcntl.ioctl(self.master, termios.TIOCSWINSZ, struct.pack('HHHH', lines, columns, 0, 0))
        if tell:
            self.screen.resize(lines, columns)
            self.process.send_signal(signal.SIGWINCH)

    def type(self, *keys: str) -> None:
        """Press keys, a short while apart so that an escape is one."""
        for key in keys:
            os.write(self.master, KEYS.get(key, key).encode())
            self.read(0.05)

    def read(self, timeout: float) -> None:
        """Take in what is written within a time, s."""
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0:
            if not select.select([self.master], [], [], left)[0]:
                return
            try:
                chunk = os.read(self.master, 65536)
            except OSError:
                return
            self.raw += chunk
            self._stream.feed(chunk)

    def until(self, condition: Callable[[str], object], timeout: float, what: str) -> str:
        """Read until the screen fulfils a condition; the screen.

        timeout: s, see SLACK.
        """
        deadline = time.monotonic() + SLACK * timeout
        while not condition(self.text):
            if time.monotonic() > deadline:
                raise AssertionError(f'Expected {what}, got the screen:\n{self.text}')
            self._meanwhile()
            self.read(0.05)
        return self.text

    def shows(self, words: str, timeout: float = 10) -> str:
        """Read until some words are on the screen; the screen."""
        return self.until(lambda text: words in text, timeout, repr(words))

    def ends(self, timeout: float) -> int:
        """Read until the program has ended; its exit code. timeout: s, see SLACK."""
        self.until(lambda _: self.process.poll() is not None, timeout, 'the end')
        self.read(0.1)
        assert self.process.returncode is not None
        return self.process.returncode

    @property
    def restored(self) -> bool:
        """Whether the terminal's modes are as before, and its first screen is back."""
        left = self.raw.rfind(b'\x1b[?1049l') > self.raw.rfind(b'\x1b[?1049h')
        shown = self.raw.rfind(b'\x1b[?25h') > self.raw.rfind(b'\x1b[?25l')
        return left and shown and termios.tcgetattr(self._slave) == self.before

    def close(self) -> None:
        """End the program by force if it still runs."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait(10)
        os.close(self.master)
        os.close(self._slave)
