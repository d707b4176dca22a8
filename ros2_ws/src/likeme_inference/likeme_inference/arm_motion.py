"""What an arm reports of itself and of a motion by its id."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple, Protocol

from likeme_core.heartbeats import HeartbeatMonitor
from likeme_inference.tabletop.values import MotionReport


class MotionState(IntEnum):
    """How far a motion is; the numbers of likeme_msgs/Motion."""

    UNKNOWN = 0
    UNDER_WAY = 1
    ENDED = 2


class StatusReport(NamedTuple):
    """The answer of arm/motion_status; `report` of a motion that has ended."""

    state: MotionState
    report: MotionReport


class ArmHealth(Protocol):
    """Whether the arm driver is alive."""

    @property
    def run(self) -> str:
        """Id of the driver's run; empty: it was never heard."""

    def silence(self, now: float) -> float:
        """Seconds since it was heard."""


class NeverHeard:
    """The health of an arm without heartbeats."""

    run = ''

    def silence(self, now: float) -> float:
        """Infinite."""
        del now
        return math.inf


class ArmHeartbeats:
    """The health of the arm driver by its heartbeats."""

    def __init__(self, monitor: HeartbeatMonitor, name: str) -> None:
        """name: fully qualified name of its node."""
        self._monitor, self._name = monitor, name

    @property
    def run(self) -> str:
        """Id of the driver's run; empty: it was never heard."""
        known = self._monitor.nodes.get(self._name)
        return '' if known is None else known.run

    def silence(self, now: float) -> float:
        """Seconds since it was heard; infinite if it never was."""
        return self._monitor.silence(self._name, now)
