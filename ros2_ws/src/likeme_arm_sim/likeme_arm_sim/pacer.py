"""Keeps simulated time in step with the wall clock."""

from __future__ import annotations

import time

# After a stall the simulation does not catch up by more than this, s.
MAX_LAG = 0.1


class Pacer:
    """Sleeps so that simulated time does not run ahead of the wall clock."""

    def __init__(self) -> None:
        self._wall = self._simulated = self._factor = 0.0

    def restart(self, simulated: float) -> None:
        """Take the present as the reference; `simulated` in s."""
        self._wall, self._simulated = time.monotonic(), simulated

    def wait(self, simulated: float, factor: float) -> None:
        """Sleep until simulated time is due at `factor` simulated s per s; 0 never sleeps."""
        if factor != self._factor or factor <= 0.0:
            # The time since the reference passed at another rate.
            self._factor = factor
            self.restart(simulated)
            return
        ahead = self._wall + (simulated - self._simulated) / factor - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)
        elif ahead < -MAX_LAG:
            self.restart(simulated)
