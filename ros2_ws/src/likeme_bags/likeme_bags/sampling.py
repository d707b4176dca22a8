"""Recorded streams at a steady rate: at each moment the last message there was."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from likeme_bags.reading import Bag
from likeme_bags.values import Record


def rate_of(stamps: NDArray[np.int64]) -> float:
    """The usual rate of a stream, Hz: one over the median step; 0 with fewer than two messages."""
    steps = np.diff(np.sort(stamps))
    steps = steps[steps > 0]
    return 1e9 / float(np.median(steps)) if len(steps) else 0.0


def moments(begin: int, count: int, rate: float) -> NDArray[np.int64]:
    """Times at a steady rate (Hz) from a first one on, ns, (count,).

    Each half a step later, so that what came a little late still counts for its own step.
    """
    return begin + np.round((np.arange(count) + 0.5) * 1e9 / rate).astype(np.int64)


def held(bag: Bag, topics: Sequence[str], times: NDArray[np.int64]) -> Iterator[dict[str, Record]]:
    """At each time (ns, rising) the last record of every topic so far; topics without one lack."""
    last: dict[str, Record] = {}
    records = bag.records(topics)
    ahead = next(records, None)
    for time in times.tolist():
        while ahead is not None and ahead.stamp <= time:
            last[ahead.topic] = ahead
            ahead = next(records, None)
        yield dict(last)
