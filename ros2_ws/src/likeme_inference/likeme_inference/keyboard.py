"""Lines that an operator types after a question was shown, and none typed before."""

from __future__ import annotations

import contextlib
import os
import select
import termios

#: Bytes per read.
CHUNK = 4096
#: For an operator who typed before there was a question.
DISCARDED = 'What was typed before this question is not taken as its answer.'


class Keyboard:
    """Reads lines from a file descriptor: a terminal, a pipe or a file."""

    def __init__(self, descriptor: int = 0) -> None:
        self._descriptor = descriptor
        self._typed = b''
        self._ended = False

    def discard(self) -> int:
        """Drop what was typed so far; the number of bytes dropped that were seen."""
        dropped = len(self._typed)
        self._typed = b''
        if os.isatty(self._descriptor):
            with contextlib.suppress(termios.error):
                termios.tcflush(self._descriptor, termios.TCIFLUSH)
            return dropped
        while not self._ended and select.select([self._descriptor], [], [], 0)[0]:
            chunk = os.read(self._descriptor, CHUNK)
            self._ended = not chunk
            dropped += len(chunk)
        return dropped

    def ready(self, timeout: float) -> bool:
        """Whether `line` has something to read within `timeout`, s, or the input has ended."""
        waiting = self._typed or self._ended
        return bool(waiting or select.select([self._descriptor], [], [], timeout)[0])

    def line(self) -> str:
        """The next line, without its end.

        Raises:
            EOFError: the input has ended.
        """
        while b'\n' not in self._typed and not self._ended:
            chunk = os.read(self._descriptor, CHUNK)
            self._ended = not chunk
            self._typed += chunk
        if not self._typed:
            raise EOFError
        line, _, self._typed = self._typed.partition(b'\n')
        return line.decode('utf-8', 'replace')
