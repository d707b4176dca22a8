"""Colour and depth images paired by stamp, and stamps that run backwards told from a new start."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar('T')

SECOND = 1_000_000_000


class StampPairing(Generic[T]):
    """Keeps the last few items of two streams until one of each lies within a tolerance (s)."""

    def __init__(self, tolerance: float, stamp_of: Callable[[T], int], keep: int = 4) -> None:
        self._tolerance = int(tolerance * SECOND)
        self._stamp_of = stamp_of
        self._keep = keep
        self._waiting: tuple[dict[int, T], dict[int, T]] = ({}, {})
        self.unpaired = 0
        # Items that no partner came for at all: the other stream is missing, or stamped otherwise.
        self.alone = 0

    def add(self, stream: int, item: T) -> tuple[T, T] | None:
        """Take an item of stream 0 or 1; the pair (0, 1) it completes.

        Everything older than the pair is given up: the newest counts.
        """
        stamp = self._stamp_of(item)
        other = self._waiting[1 - stream]
        nearest = min(other, key=lambda s: abs(s - stamp), default=None)
        if nearest is None or abs(nearest - stamp) > self._tolerance:
            self._wait(stream, stamp, item)
            return None
        partner = other.pop(nearest)
        self._forget(max(stamp, nearest))
        return (item, partner) if stream == 0 else (partner, item)

    def _wait(self, stream: int, stamp: int, item: T) -> None:
        mine = self._waiting[stream]
        mine[stamp] = item
        while len(mine) > self._keep:
            mine.pop(next(iter(mine)))
            self.unpaired += 1
            self.alone += 1

    def _forget(self, stamp: int) -> None:
        for waiting in self._waiting:
            for old in [s for s in waiting if s <= stamp]:
                del waiting[old]
                self.unpaired += 1


class StampOrder:
    """Lets stamps pass that go up, and notices when a stream has started anew.

    A single older frame is late. Many in a row, or two jumps back by more than a second, are a
    simulation or a recording that began again.
    """

    def __init__(self, patience: int = 30, jump: float = 1.0) -> None:
        self._patience = patience
        self._jump = int(jump * SECOND)
        self._last: int | None = None
        self._older = 0
        self._jumps = 0

    def take(self, stamp: int) -> str:
        """Say 'new' for a frame to use, 'older' for one to drop, 'restart' for a new start."""
        if self._last is None or stamp > self._last:
            self._accept(stamp)
            return 'new'
        self._older += 1
        self._jumps += self._last - stamp > self._jump
        if self._older < self._patience and self._jumps < 2:
            return 'older'
        self._accept(stamp)
        return 'restart'

    def _accept(self, stamp: int) -> None:
        self._last, self._older, self._jumps = stamp, 0, 0
