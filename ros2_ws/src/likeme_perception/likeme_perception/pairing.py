"""Pairing of colour and depth images by stamp, and detection of stamps that start again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from likeme_core.stamps import SECOND

T = TypeVar('T')


class StampPairing(Generic[T]):
    """Keeps the last few items of two streams until one of each lies within a tolerance (s)."""

    def __init__(self, tolerance: float, stamp_of: Callable[[T], int], keep: int = 4) -> None:
        self._tolerance = int(tolerance * SECOND)
        self._stamp_of = stamp_of
        self._keep = keep
        self._waiting: tuple[dict[int, T], dict[int, T]] = ({}, {})
        self.unpaired = 0
        # Items for which no partner came: the other stream is missing, or stamped differently.
        self.alone = 0

    def add(self, stream: int, item: T) -> tuple[T, T] | None:
        """Add an item of stream 0 or 1; returns the pair (0, 1) that it completes.

        Items older than the pair are dropped.
        """
        stamp = self._stamp_of(item)
        other = self._waiting[1 - stream]
        nearest = min(other, key=lambda s: abs(s - stamp), default=None)
        if nearest is None or abs(nearest - stamp) > self._tolerance:
            self._wait(stream, stamp, item)
            return None
        partner = other.pop(nearest)
        self._drop_up_to(max(stamp, nearest))
        return (item, partner) if stream == 0 else (partner, item)

    def _wait(self, stream: int, stamp: int, item: T) -> None:
        mine = self._waiting[stream]
        mine[stamp] = item
        while len(mine) > self._keep:
            mine.pop(next(iter(mine)))
            self.unpaired += 1
            self.alone += 1

    def _drop_up_to(self, stamp: int) -> None:
        for waiting in self._waiting:
            for old in [s for s in waiting if s <= stamp]:
                del waiting[old]
                self.unpaired += 1


class StampOrder:
    """Accepts increasing stamps and detects that a stream has started again.

    A single older frame is late. Many in a row, or two jumps back by more than a second, are a
    simulation or a recording that started again. A single frame that is far ahead has a wrong
    stamp; if the next one follows it, the stream went on after a pause, or its clock was set.
    """

    def __init__(self, late_frames: int = 30, jump: float = 1.0, ahead: float = 10.0) -> None:
        """Set the limits.

        Args:
            late_frames: older frames in a row that are a new start.
            jump: s back that count as a jump.
            ahead: s forward that count as a jump.
        """
        self._late_frames = late_frames
        self._jump, self._ahead = int(jump * SECOND), int(ahead * SECOND)
        self._last: int | None = None
        self._older = 0
        self._jumps = 0
        self._doubted: int | None = None

    def classify(self, stamp: int) -> str:
        """Whether to use a frame ('new'; 'restart': with new tracks) or not ('older', 'ahead')."""
        doubted, self._doubted = self._doubted, None
        if self._last is None or self._last < stamp <= self._last + self._ahead:
            self._accept(stamp)
            return 'new'
        if stamp > self._last:
            if doubted is not None and doubted < stamp <= doubted + self._ahead:
                self._accept(stamp)
                return 'restart'
            self._doubted = stamp
            return 'ahead'
        self._older += 1
        self._jumps += self._last - stamp > self._jump
        if self._older < self._late_frames and self._jumps < 2:
            return 'older'
        self._accept(stamp)
        return 'restart'

    def _accept(self, stamp: int) -> None:
        self._last, self._older, self._jumps = stamp, 0, 0
