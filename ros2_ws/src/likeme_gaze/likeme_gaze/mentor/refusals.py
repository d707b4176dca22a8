"""What was refused and why: counted by reason, and said at most once in a while for each."""

from __future__ import annotations

import math
from collections import Counter

#: s between two sentences about one reason.
SILENCE = 5.0


class RefusedError(ValueError):
    """An input that cannot be used: a sentence with what was expected and what came.

    Attributes:
        reason: in a few words, the same for all of a kind.
    """

    def __init__(self, reason: str, sentence: str) -> None:
        super().__init__(sentence)
        self.reason = reason


class Refusals:
    """Counts refusals; times that callers pass are s and only go up.

    Attributes:
        counts: by reason.
        last: when the last one was, or None.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.last: float | None = None
        self._said: dict[str, float] = {}

    def add(self, error: ValueError, now: float) -> str | None:
        """Count one; what to say about it, or None if its reason was said just now."""
        reason = getattr(error, 'reason', 'not usable')
        self.counts[reason] += 1
        self.last = now
        if now - self._said.get(reason, -math.inf) < SILENCE:
            return None
        self._said[reason] = now
        return f'Refused ({reason}, {self.counts[reason]} so far): {error}'

    def recent(self, now: float, within: float) -> bool:
        """Whether anything was refused within the last s."""
        return self.last is not None and now - self.last < within
