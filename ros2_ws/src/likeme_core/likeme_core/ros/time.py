"""Between builtin_interfaces/Time and stamps in ns."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from rclpy.clock import Clock, ClockType

from likeme_core.stamps import SECOND


def stamp_ns(stamp: Time) -> int:
    """Nanoseconds of a message's time."""
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def time_msg(nanoseconds: int) -> Time:
    """Message of a time in nanoseconds."""
    sec, nanosec = divmod(nanoseconds, SECOND)
    return Time(sec=sec, nanosec=nanosec)


def steady_clock() -> Clock:
    """A clock for timers that must run while /clock stands still."""
    return Clock(clock_type=ClockType.STEADY_TIME)
