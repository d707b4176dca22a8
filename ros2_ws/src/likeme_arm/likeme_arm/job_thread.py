"""The thread of a driver: it runs queued jobs, and an idle function between them."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, NamedTuple

# For the running job to end in when the thread is stopped, s.
JOIN_TIMEOUT = 5.0
# After an error of the idle function, s.
RETRY_DELAY = 0.1


class Job(NamedTuple):
    """A queued function and who asked for it."""

    owner: str
    run: Callable[[], Any]
    future: Future[Any]


class JobThread:
    """Runs jobs one after another in its own thread; calls `idle` repeatedly between them.

    Each owner may have one job queued or running. The exception of a job is set on its future,
    that of `idle` is given to `on_error`; neither ends the thread.
    """

    def __init__(self, idle: Callable[[], None], on_error: Callable[[Exception], None]) -> None:
        self._idle, self._on_error = idle, on_error
        self._lock, self._stopping = threading.Lock(), threading.Event()
        self._jobs: deque[Job] = deque()
        self._thread = threading.Thread(target=self._run, name='driver', daemon=True)

    @property
    def busy(self) -> bool:
        """Whether a job is queued or running."""
        return bool(self._jobs)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def submit(self, owner: str, job: Callable[[], Any]) -> Future[Any] | None:
        """Queue a job; None if this owner's last job has not ended or the thread is stopping."""
        with self._lock:
            if self._stopping.is_set() or any(other.owner == owner for other in self._jobs):
                return None
            future: Future[Any] = Future()
            self._jobs.append(Job(owner, job, future))
            return future

    def stop(self) -> None:
        """Accept no more jobs and wait for the running one.

        Raises:
            TimeoutError: it has not ended within JOIN_TIMEOUT.
        """
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(JOIN_TIMEOUT)
        if self._thread.is_alive():
            raise TimeoutError(
                f'Expected the driver thread to end within {JOIN_TIMEOUT:g} s, it still runs.'
            )

    def _run(self) -> None:
        while not self._stopping.is_set() or self._jobs:
            if not self._jobs:
                self._run_idle()
                continue
            # The job stays queued until it has ended, so that `busy` and `submit` see it.
            _, run, future = self._jobs[0]
            try:
                result = run()
            except Exception as error:
                self._remove_job()
                future.set_exception(error)
            else:
                self._remove_job()
                future.set_result(result)

    def _remove_job(self) -> None:
        # `submit` iterates over the queue in another thread.
        with self._lock:
            self._jobs.popleft()

    def _run_idle(self) -> None:
        try:
            self._idle()
        except Exception as error:
            self._on_error(error)
            self._stopping.wait(RETRY_DELAY)
