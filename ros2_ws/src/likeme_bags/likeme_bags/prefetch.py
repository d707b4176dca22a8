"""Chunks decompressed by other threads before they are asked for.

Decompressing camera noise takes longer than the rest of reading (1.7 of 2.4 ms a frame by zstd),
and zstd, lz4, CRC-32 and `pread` release Python's lock meanwhile.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, TypeVar

T = TypeVar('T')

#: Decompressed bytes that may be under way or wait to be asked for.
MAX_PENDING = 32 * 2**20
#: A chunk of fewer bytes is decompressed where it is asked for.
MIN_SIZE = 2**17
#: Threads at most; with more, the one that asks would only wait for Python's lock.
THREADS = 2
#: Chunks begun beyond the one that is asked for, at most.
DEPTH = 3


class Prefetcher(Generic[T]):
    """Gives chunks by their number; when they are asked for in order, the next ones are begun."""

    def __init__(self, read: Callable[[int], T], size_of: Callable[[int], int]) -> None:
        """Nothing is begun yet.

        read: gives a chunk, from any thread; what it raises is raised where the chunk is asked
        for. size_of: its decompressed bytes; 0 where there is none.
        """
        self._read, self._size_of = read, size_of
        self._begun: dict[int, Future[T]] = {}
        self._threads = min(THREADS, len(os.sched_getaffinity(0)))
        self._pool: ThreadPoolExecutor | None = None
        self._last = -2

    def get(self, number: int) -> T:
        """The chunk of this number."""
        in_order = number == self._last + 1
        self._last = number
        future = self._begun.pop(number, None)
        self._forget(number if in_order else None)
        if in_order and self._threads > 1:
            self._begin(number + 1)
        return self._read(number) if future is None else future.result()

    def close(self) -> None:
        """Drop what was begun; nothing is read any more when this returns."""
        self._forget()
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
            self._pool = None

    def _begin(self, first: int) -> None:
        room = MAX_PENDING
        for number in range(first, first + DEPTH):
            size = self._size_of(number)
            room -= size
            if size < MIN_SIZE or room < 0:
                return
            if number not in self._begun:
                if self._pool is None:
                    self._pool = ThreadPoolExecutor(self._threads, 'prefetch')
                try:
                    self._begun[number] = self._pool.submit(self._read, number)
                except RuntimeError:
                    # The system gives no more threads: all is read where it is asked for.
                    self._threads = 1
                    return

    def _forget(self, up_to: int | None = None) -> None:
        """Drop chunks up to this one, which nobody will ask for now; None: all."""
        for number in list(self._begun):
            if up_to is None or number <= up_to:
                self._begun.pop(number).cancel()
