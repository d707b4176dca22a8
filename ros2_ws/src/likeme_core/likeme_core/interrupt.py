"""Deferred SIGINT: KeyboardInterrupt raised only where the program checks for it.

Python raises KeyboardInterrupt at any point. Inside rclpy's C++ code it becomes a RuntimeError
about some argument, so a program that spins a node checks for the signal between two spins.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def deferred_interrupt() -> Iterator[Callable[[], None]]:
    """Defer SIGINT; the yielded function raises KeyboardInterrupt for it, once.

    A second SIGINT before that has Python's default effect. Main thread only.
    """
    received = False

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal received
        if received:
            signal.default_int_handler(number, frame)
        received = True

    def check() -> None:
        nonlocal received
        if received:
            received = False
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, handle)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
    # A signal after the last check must not be lost.
    check()
