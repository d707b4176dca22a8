"""Rejected inputs: counted by reason, with at most one log message per reason and period."""

from __future__ import annotations

import math
from collections import Counter

#: s between two log messages about one reason.
LOG_PERIOD = 5.0


class RejectedInputError(ValueError):
    """An input that cannot be used; the message states what was expected and what was received.

    Attributes:
        reason: a short key, the same for all rejections of a kind.
    """

    def __init__(self, reason: str, sentence: str) -> None:
        super().__init__(sentence)
        self.reason = reason


class RejectionCounter:
    """Counts rejected inputs. Times are s of a monotonic clock.

    Attributes:
        counts: by reason.
        last: time of the last rejection, or None.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.last: float | None = None
        self._logged: dict[str, float] = {}

    def add(self, error: ValueError, now: float) -> str | None:
        """Count a rejection; the message to log, or None if its reason was logged recently."""
        reason = getattr(error, 'reason', 'not usable')
        self.counts[reason] += 1
        self.last = now
        if now - self._logged.get(reason, -math.inf) < LOG_PERIOD:
            return None
        self._logged[reason] = now
        return f'Refused ({reason}, {self.counts[reason]} so far): {error}'

    def recent(self, now: float, within: float) -> bool:
        """Whether anything was rejected within the last `within` s."""
        return self.last is not None and now - self.last < within
