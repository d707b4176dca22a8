"""Stamps are ROS time in integer nanoseconds."""

from __future__ import annotations

#: Nanoseconds in a second.
SECOND = 1_000_000_000


def nanoseconds(seconds: float) -> int:
    """A duration in ns."""
    return round(seconds * SECOND)


def seconds(nanoseconds: int) -> float:
    """A duration in s."""
    return nanoseconds / SECOND
