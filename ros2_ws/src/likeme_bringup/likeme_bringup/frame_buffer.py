"""Frames of one part of an act, in bounded memory."""

from __future__ import annotations

from typing import Generic, TypeVar

T = TypeVar('T')
MAX_FRAMES = 64


class FrameBuffer(Generic[T]):
    """Keeps frames spread evenly over the time since the last `clear`."""

    def __init__(self) -> None:
        self._frames: list[T] = []
        # Every how many frames one is kept, and how many have come.
        self._stride, self._count = 1, 0

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, frame: T) -> None:
        """Keep a frame; when there are MAX_FRAMES, drop every other one."""
        if self._count % self._stride == 0:
            self._frames.append(frame)
        self._count += 1
        if len(self._frames) > MAX_FRAMES:
            del self._frames[1::2]
            self._stride *= 2

    def middle(self) -> T:
        """The frame from halfway through."""
        return self._frames[len(self._frames) // 2]

    def clear(self) -> None:
        """Drop all frames."""
        self._frames.clear()
        self._stride, self._count = 1, 0
