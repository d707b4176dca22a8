"""Ctrl-C at a moment of one's own choice.

Python raises KeyboardInterrupt wherever it happens to be. In the middle of rclpy's C++ that comes
out as a RuntimeError about some argument, so those who spin a node note the signal and ask for it
between two spins.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def noted_interrupt() -> Iterator[Callable[[], None]]:
    """Note SIGINT; the function that is given raises KeyboardInterrupt for it, once.

    A second SIGINT before that is Python's own. For the main thread alone.
    """
    noted = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal noted
        if noted:
            signal.default_int_handler(number, frame)
        noted = True

    def check() -> None:
        nonlocal noted
        if noted:
            noted = False
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
    # What came after the last question must not be forgotten.
    check()
