"""Conversion between builtin_interfaces/Time and stamps in ns; clocks."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from rclpy.clock import Clock, ClockType

from likeme_core.stamps import SECOND, stamp_ns

__all__ = ['stamp_ns', 'steady_clock', 'time_msg']


def time_msg(nanoseconds: int) -> Time:
    """The message of a stamp in nanoseconds."""
    sec, nanosec = divmod(nanoseconds, SECOND)
    return Time(sec=sec, nanosec=nanosec)


def steady_clock() -> Clock:
    """A clock for timers that must also run while /clock does not advance."""
    return Clock(clock_type=ClockType.STEADY_TIME)
