"""Simulated time, in place of the clocks that nodes read.

`install` must come before the nodes are imported: some keep a clock as a default argument.
"""

from __future__ import annotations

import time

#: System time at the start of simulated time, ns.
EPOCH = 1_790_000_000_000_000_000
SECOND = 1_000_000_000


class SimTime:
    """Two clocks: a steady one, and the system's, which may jump.

    Attributes:
        now: ns of the steady clock.
        jump: ns by which the system clock has been set forwards.
    """

    def __init__(self) -> None:
        self.now, self.jump = SECOND, 0

    @property
    def system(self) -> int:
        """System time, ns."""
        return EPOCH + self.now + self.jump

    @property
    def seconds(self) -> float:
        """The steady clock in s."""
        return self.now / SECOND

    def install(self) -> None:
        """Have this process read simulated time from `time`."""
        time.monotonic = lambda: self.seconds
        time.time_ns = lambda: self.system
        time.time = lambda: self.system / SECOND


#: Of this process.
SIM_TIME = SimTime()
