"""When a process that died is started again, and when no more."""

from __future__ import annotations

import os
from typing import NamedTuple

#: Exit code of a process that refuses its parameters, see likeme_core.ros.spin.
REFUSED = os.EX_CONFIG


class Respawn(NamedTuple):
    """The pauses between a death and the next start.

    Attributes:
        pauses: s, after the first, second, ... death in a row. One death more is the last.
        stable: s of life after which a death is the first in a row again.
        standby: s of life after which a standby process is started, see `Child.standby`; None:
            there are none.
    """

    pauses: tuple[float, ...] = (0.0, 0.5, 1.0, 2.0)
    stable: float = 30.0
    standby: float | None = 10.0


class Lives:
    """The starts and deaths of one process.

    Times are s of a monotonic clock, passed in.

    Attributes:
        restarts: starts that followed a death.
    """

    def __init__(self, policy: Respawn) -> None:
        self._policy = policy
        self._started = 0.0
        self._in_a_row = 0
        self.restarts = 0

    def start(self, now: float) -> None:
        """The process starts now."""
        self._started = now

    def death(self, code: int, now: float) -> float | None:
        """The pause until the next start, s; None if there is none.

        code: exit code as subprocess gives it. 0: it was told to stop. REFUSED at its first start:
        the parameters are wrong, and will be so again; later the reason may be passing.
        """
        if code == 0 or (code == REFUSED and self.restarts == 0):
            return None
        if now - self._started >= self._policy.stable:
            self._in_a_row = 0
        self._in_a_row += 1
        if self._in_a_row > len(self._policy.pauses):
            return None
        self.restarts += 1
        return self._policy.pauses[self._in_a_row - 1]

    @property
    def exhausted(self) -> str:
        """Why there is no next start, after the end in a sentence; empty before that."""
        if not self._policy.pauses or self._in_a_row <= len(self._policy.pauses):
            return ''
        return f', death {self._in_a_row} in a row within {self._policy.stable:g} s of a start'
