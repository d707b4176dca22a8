"""Log lines that repeat, as refusals of a client that asks again at once."""

from __future__ import annotations

import time
from collections.abc import Callable

#: s between two lines that say the same.
PERIOD = 5.0


class RepeatedLine:
    """Leaves out a line that says what the last one said, and counts it.

    Not thread-safe.
    """

    def __init__(
        self, period: float = PERIOD, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """period: between two equal lines, s. clock: monotonic, s."""
        self._period, self._clock = period, clock
        self._text, self._since, self._left_out = '', 0.0, 0

    def line(self, text: str) -> str | None:
        """The line to write, with the number of equal ones that were left out; None: none now."""
        now = self._clock()
        if text == self._text and now - self._since < self._period:
            self._left_out += 1
            return None
        count = self._left_out
        again = f'{text} ({count} more like it)' if text == self._text and count else text
        self._text, self._since, self._left_out = text, now, 0
        return again
