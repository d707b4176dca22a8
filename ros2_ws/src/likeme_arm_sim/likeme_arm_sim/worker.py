"""The one thread that touches the simulation: one job at a time, and idling in between."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any


class Worker:
    """Runs jobs one after another in a thread of its own, and `idle` again and again between them.

    A job or `idle` that fails is told to `on_error`; the thread lives on.
    """

    def __init__(self, idle: Callable[[], None], on_error: Callable[[Exception], None]) -> None:
        self._idle, self._on_error = idle, on_error
        self._lock, self._stopping = threading.Lock(), threading.Event()
        self._job: tuple[Callable[[], Any], Future[Any]] | None = None
        self._thread = threading.Thread(target=self._run, name='simulation', daemon=True)

    @property
    def busy(self) -> bool:
        """Whether a job runs or is about to."""
        return self._job is not None

    def start(self) -> None:
        """Begin to idle and to take jobs."""
        self._thread.start()

    def submit(self, job: Callable[[], Any]) -> Future[Any] | None:
        """Have a job done next; None when another one has not ended."""
        with self._lock:
            if self._job is not None or self._stopping.is_set():
                return None
            future: Future[Any] = Future()
            self._job = (job, future)
            return future

    def stop(self, seconds: float = 5.0) -> None:
        """Take no more jobs and wait for the running one."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(seconds)

    def _run(self) -> None:
        while not self._stopping.is_set() or self._job is not None:
            work = self._job
            if work is None:
                self._try(self._idle)
                continue
            job, future = work
            try:
                result = job()
            except Exception as error:
                self._job = None
                future.set_exception(error)
            else:
                self._job = None
                future.set_result(result)

    def _try(self, idle: Callable[[], None]) -> None:
        try:
            idle()
        except Exception as error:
            self._on_error(error)
            self._stopping.wait(0.1)
