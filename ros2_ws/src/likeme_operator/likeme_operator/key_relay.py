"""Runs a terminal program in a pseudo-terminal of its own, and sees every key before it.

The program may be busy drawing when a key comes that must not wait.
"""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import threading
import tty
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from types import FrameType

from likeme_core.processes import interrupt, start

CHUNK = 65536
#: s between two looks whether the program has ended.
END_PERIOD = 0.1
#: s in which the program ends after it was asked to.
GRACE = 5.0
#: Leaves the second screen, shows the cursor, ends mouse, paste and key modes: what a program that
#: was killed leaves behind.
RESTORE = b'\x1b[?1049l\x1b[?25h\x1b[?1000l\x1b[?1003l\x1b[?1006l\x1b[?2004l\x1b[<u\x1b[0m\r\n'


def relay_keys(
    command: Sequence[str], seen: Callable[[bytes], None], environment: Mapping[str, str]
) -> int:
    """Run a program on this process's terminal until it ends; its exit code.

    SIGTERM and SIGHUP end it as they end this process.

    Args:
        command: of the program.
        seen: called with the bytes of the keys before the program gets them.
        environment: added to that of this process.
    """
    # Textual would take them for the size, whatever becomes of the terminal.
    for name in ('COLUMNS', 'LINES'):
        os.environ.pop(name, None)
    master, slave = pty.openpty()
    _copy_size(master)
    process = start(command, slave, environment, stdin=slave)
    os.close(slave)
    try:
        with _raw_terminal(), _signals(process, master):
            _relay(master, process, seen)
            process.wait(GRACE)
    finally:
        interrupt(process, GRACE)
        os.close(master)
        code = int(process.returncode)
        if code < 0:
            with suppress(OSError):
                os.write(sys.stdout.fileno(), RESTORE)
    return code


def _relay(master: int, process: subprocess.Popen[bytes], seen: Callable[[bytes], None]) -> None:
    """Pass keys on until the program has closed its side."""
    # A terminal that shows slowly must not keep a key from being seen: a thread of its own.
    output = threading.Thread(target=_copy_output, args=(master,), daemon=True)
    output.start()
    keys = sys.stdin.fileno()
    while output.is_alive():
        if not select.select([keys], [], [], END_PERIOD)[0]:
            continue
        typed = os.read(keys, CHUNK)
        if not typed:
            # The terminal has gone.
            process.terminate()
            output.join(GRACE)
            return
        seen(typed)
        with suppress(OSError):
            os.write(master, typed)


def _copy_output(master: int) -> None:
    # The program has closed its side, or the terminal has gone.
    with suppress(OSError):
        while True:
            _write(sys.stdout.fileno(), os.read(master, CHUNK))


def _write(descriptor: int, data: bytes) -> None:
    while data:
        data = data[os.write(descriptor, data) :]


def _copy_size(master: int) -> None:
    with suppress(OSError):
        size = fcntl.ioctl(sys.stdout.fileno(), termios.TIOCGWINSZ, b'\0' * 8)
        fcntl.ioctl(master, termios.TIOCSWINSZ, size)


@contextmanager
def _raw_terminal() -> Iterator[None]:
    """Keys come one by one and unchanged, Ctrl-C among them."""
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        tty.setraw(descriptor)
        yield
    finally:
        with suppress(termios.error):
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


@contextmanager
def _signals(process: subprocess.Popen[bytes], master: int) -> Iterator[None]:
    """Pass the signals of the terminal on to the program."""

    def resized(number: int, frame: FrameType | None) -> None:
        _copy_size(master)
        process.send_signal(signal.SIGWINCH)

    def ended(number: int, frame: FrameType | None) -> None:
        process.terminate()

    handlers = {signal.SIGWINCH: resized, signal.SIGTERM: ended, signal.SIGHUP: ended}
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
