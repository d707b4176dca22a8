"""Deferred signals: KeyboardInterrupt raised only where the program checks for it.

Python raises KeyboardInterrupt at any point. Inside rclpy's C++ code it becomes a RuntimeError
about some argument, so a program that spins a node checks for the signal between two spins.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def deferred_interrupt(
    *numbers: signal.Signals,
) -> Iterator[Callable[[], None]]:
    """Defer signals; the yielded function raises KeyboardInterrupt for them, once.

    A second signal before that raises KeyboardInterrupt at once. Main thread only.

    Args:
        numbers: the signals; none: SIGINT alone.
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

    before = {number: signal.signal(number, handle) for number in numbers or (signal.SIGINT,)}
    try:
        yield check
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    # A signal after the last check must not be lost.
    check()
