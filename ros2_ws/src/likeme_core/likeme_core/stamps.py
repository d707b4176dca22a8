"""Stamps: ROS time in integer nanoseconds."""

from __future__ import annotations

from typing import Any

#: Nanoseconds in a second.
SECOND = 1_000_000_000


def nanoseconds(seconds: float) -> int:
    """A duration in ns."""
    return round(seconds * SECOND)


def seconds(nanoseconds: int) -> float:
    """A duration in s."""
    return nanoseconds / SECOND


def stamp_ns(stamp: Any) -> int:
    """Nanoseconds of a Time message of any library: rclpy's and rosbags' have the same fields."""
    return int(stamp.sec) * SECOND + int(stamp.nanosec)
