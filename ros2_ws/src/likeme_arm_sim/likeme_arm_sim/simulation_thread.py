"""The one thread that touches the simulation: one job at a time, and idling in between."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, NamedTuple

# For a running job to come to its end, s.
PATIENCE = 5.0


class Job(NamedTuple):
    """Something to be done for somebody."""

    owner: str
    run: Callable[[], Any]
    future: Future[Any]


class SimulationThread:
    """Runs jobs one after another in a thread of its own, and `idle` again and again between them.

    Every owner may have one job that runs or waits for the others' to end. A job that fails tells
    its future, `idle` tells `on_error`; the thread lives on.
    """

    def __init__(self, idle: Callable[[], None], on_error: Callable[[Exception], None]) -> None:
        self._idle, self._on_error = idle, on_error
        self._lock, self._stopping = threading.Lock(), threading.Event()
        self._jobs: deque[Job] = deque()
        self._thread = threading.Thread(target=self._run, name='simulation', daemon=True)

    @property
    def busy(self) -> bool:
        """Whether a job runs or is about to."""
        return bool(self._jobs)

    def start(self) -> None:
        """Begin to idle and to take jobs."""
        self._thread.start()

    def submit(self, owner: str, job: Callable[[], Any]) -> Future[Any] | None:
        """Have a job done as soon as may be; None when this owner's last one has not ended."""
        with self._lock:
            if self._stopping.is_set() or any(other.owner == owner for other in self._jobs):
                return None
            future: Future[Any] = Future()
            self._jobs.append(Job(owner, job, future))
            return future

    def stop(self) -> None:
        """Take no more jobs and wait for the running one."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(PATIENCE)

    def _run(self) -> None:
        while not self._stopping.is_set() or self._jobs:
            if not self._jobs:
                self._try(self._idle)
                continue
            # It stays in the queue until it has ended, so that `busy` and `submit` see it.
            _, run, future = self._jobs[0]
            try:
                result = run()
            except Exception as error:
                self._end_job()
                future.set_exception(error)
            else:
                self._end_job()
                future.set_result(result)

    def _end_job(self) -> None:
        # `submit` goes through the queue at the same time.
        with self._lock:
            self._jobs.popleft()

    def _try(self, idle: Callable[[], None]) -> None:
        try:
            idle()
        except Exception as error:
            self._on_error(error)
            self._stopping.wait(0.1)
