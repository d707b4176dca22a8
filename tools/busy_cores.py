"""Every core busy: what a replay in lockstep must not notice, for its test and its benchmark."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager


def spin(parent: int, stop_at: float, niceness: int = 0) -> None:
    """Never rest until `stop_at` (s, of the steady clock), or until the parent is gone."""
    os.nice(niceness)
    while time.monotonic() < stop_at and os.getppid() == parent:
        sum(range(100_000))


@contextmanager
def busy_cores(seconds: float, niceness: int = 0) -> Iterator[None]:
    """One process that never rests for each core this one may use, for `seconds` at most.

    niceness: added to that of this process.
    """
    context = multiprocessing.get_context('spawn')
    given = os.getpid(), time.monotonic() + seconds, niceness
    spinning = [
        context.Process(target=spin, args=given, daemon=True) for _ in os.sched_getaffinity(0)
    ]
    for process in spinning:
        process.start()
    try:
        yield
    finally:
        for process in spinning:
            process.kill()
            process.join()
