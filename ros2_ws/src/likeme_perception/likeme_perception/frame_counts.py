"""How many frames were read and dropped and how long they took, for those who look after it."""

from __future__ import annotations

from collections import Counter, deque
from typing import NamedTuple

import numpy as np

# Frames over which times are judged, and s between two sentences about dropped frames.
_KEPT = 300
_LOG_PERIOD = 5.0


class Rate(NamedTuple):
    """Frames read per s and frames dropped since the last time this was asked."""

    frames: float
    drops: int


class Throttle:
    """Lets something happen at most once a period (s), counted in stamps (ns)."""

    def __init__(self, period: float) -> None:
        self._period, self._last = round(period * 1e9), 0

    def due(self, stamp: int) -> bool:
        """Whether it is time again, as it is when stamps went back; then the period starts."""
        if abs(stamp - self._last) < self._period:
            return False
        self._last = stamp
        return True


class FrameCounts:
    """Counts frames; times of the clock that callers pass are s and only go up."""

    def __init__(self, now: float) -> None:
        self.frames_read = 0
        self.drops: Counter[str] = Counter()
        self._latency: deque[float] = deque(maxlen=_KEPT)
        self._work: deque[float] = deque(maxlen=_KEPT)
        self._last_sentence = -_LOG_PERIOD
        self._asked, self._reported = now, (0, 0)

    @property
    def judged(self) -> int:
        """Frames read and frames dropped together."""
        return self.frames_read + self.drops.total()

    def read(self, work: float, latency: float) -> None:
        """Count a frame: s of work on it, and s since its stamp."""
        self.frames_read += 1
        self._work.append(work)
        self._latency.append(latency)

    def drop(self, reason: str, sentence: str, now: float) -> str | None:
        """Count a dropped frame; what to say about it, at most once in a while."""
        self.drops[reason] += 1
        if now - self._last_sentence < _LOG_PERIOD:
            return None
        self._last_sentence = now
        return f'Frame dropped ({reason}): {sentence} {self.drops.total()} dropped so far.'

    def rate(self, now: float) -> Rate:
        """What happened since this was asked last."""
        (frames, drops), seconds = self._reported, max(now - self._asked, 1e-6)
        self._asked, self._reported = now, (self.frames_read, self.drops.total())
        return Rate((self.frames_read - frames) / seconds, self.drops.total() - drops)

    def described(self) -> dict[str, str]:
        """Median and 99th percentile of the times, ms, and the drops by reason."""
        said: dict[str, str] = {}
        for name, times in (('latency', self._latency), ('processing time', self._work)):
            if times:
                p50, p99 = np.percentile(np.array(times) * 1e3, [50, 99])
                said |= {f'{name} p50 (ms)': f'{p50:.1f}', f'{name} p99 (ms)': f'{p99:.1f}'}
        return said | {f'dropped: {reason}': str(n) for reason, n in sorted(self.drops.items())}
