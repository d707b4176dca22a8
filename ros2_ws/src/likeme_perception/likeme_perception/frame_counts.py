"""Statistics of processed and dropped frames for the diagnostics."""

from __future__ import annotations

from collections import Counter, deque
from typing import NamedTuple

import numpy as np

# Frames over which latency statistics are computed, and s between two warnings.
_WINDOW = 300
_LOG_PERIOD = 5.0


class FrameRate(NamedTuple):
    """Frames processed per s and frames dropped since the previous call."""

    frames: float
    drops: int


class Throttle:
    """Limits an output to one per period (s) of stamp time (ns)."""

    def __init__(self, period: float) -> None:
        self._period, self._last = round(period * 1e9), 0

    def due(self, stamp: int) -> bool:
        """Whether the period is over or the stamps went back; if so, starts a new period."""
        if abs(stamp - self._last) < self._period:
            return False
        self._last = stamp
        return True


class FrameCounts:
    """Counts frames; `now` is the time of a monotonic clock, s."""

    def __init__(self, now: float) -> None:
        self.frames_read = 0
        self.drops: Counter[str] = Counter()
        self._latency: deque[float] = deque(maxlen=_WINDOW)
        self._work: deque[float] = deque(maxlen=_WINDOW)
        self._last_warning = -_LOG_PERIOD
        self._last_time, self._last_counts = now, (0, 0)

    @property
    def received(self) -> int:
        """Frames processed and dropped together."""
        return self.frames_read + self.drops.total()

    def read(self, work: float, latency: float | None) -> None:
        """Count a processed frame; work: processing time, latency: time since its stamp, s."""
        self.frames_read += 1
        self._work.append(work)
        if latency is not None:
            self._latency.append(latency)

    def drop(self, reason: str, sentence: str, now: float) -> str | None:
        """Count a dropped frame; the warning to log, None within 5 s of the last one."""
        self.drops[reason] += 1
        if now - self._last_warning < _LOG_PERIOD:
            return None
        self._last_warning = now
        total = self.drops.total()
        return f'Frame dropped ({reason}): {sentence.rstrip(".")}; {total} dropped so far.'

    def rate(self, now: float) -> FrameRate:
        """Frames per s and drops since the previous call."""
        (frames, drops), seconds = self._last_counts, max(now - self._last_time, 1e-6)
        self._last_time, self._last_counts = now, (self.frames_read, self.drops.total())
        return FrameRate((self.frames_read - frames) / seconds, self.drops.total() - drops)

    def described(self) -> dict[str, str]:
        """Diagnostics: median and 99th percentile of the times (ms), drops by reason."""
        values: dict[str, str] = {}
        for name, times in (('latency', self._latency), ('processing time', self._work)):
            if times:
                p50, p99 = np.percentile(np.array(times) * 1e3, [50, 99])
                values |= {f'{name} p50 (ms)': f'{p50:.1f}', f'{name} p99 (ms)': f'{p99:.1f}'}
        return values | {f'dropped: {reason}': str(n) for reason, n in sorted(self.drops.items())}
