"""QoS profiles as bags write them: YAML in a string (up to version 8) or in place (version 9)."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import yaml
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2.metadata import parse_qos

from likeme_bags.errors import LIBRARY_ERRORS, DamagedError
from likeme_bags.limits import MAX_TEXT

# How rosbag2 writes a duration without limit.
FOREVER = QosTime(9223372036, 854775807)
# A ROS 1 topic that was latched: the last message for whoever comes late.
LATCHED = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    FOREVER,
    FOREVER,
    QosLiveliness.AUTOMATIC,
    FOREVER,
    False,
)


def profiles(written: str | list[Any] | None) -> tuple[Qos, ...]:
    """Profiles from what a bag says.

    Raises:
        DamagedError: it is something else than profiles.
    """
    if isinstance(written, str):
        return _from_text(written)
    return _from_list(written or [])


@lru_cache(maxsize=256)
def _from_text(text: str) -> tuple[Qos, ...]:
    if len(text) > MAX_TEXT:
        raise DamagedError(f'Expected QoS profiles, got {len(text)} bytes.')
    try:
        return _from_list(yaml.load(text, yaml.CSafeLoader) or [])
    except (yaml.YAMLError, RecursionError, ValueError):
        raise DamagedError(f'Expected QoS profiles as YAML, got {text[:40]!r}.') from None


def _from_list(items: list[Any]) -> tuple[Qos, ...]:
    try:
        found = tuple(parse_qos(items))
        times = [t for q in found for t in (q.deadline, q.lifespan, q.liveliness_lease_duration)]
        numbers = [*(q.depth for q in found), *(n for t in times for n in t)]
    except LIBRARY_ERRORS:
        raise DamagedError('Expected QoS profiles, got a list of something else.') from None
    if not all(isinstance(n, int) and 0 <= n < 2**64 for n in numbers):
        raise DamagedError(f'Expected whole numbers in QoS profiles, got {numbers[:8]}.')
    return found
