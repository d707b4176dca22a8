"""Recorded streams at a steady rate: at each time the last message there was."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from likeme_bags.errors import BagError
from likeme_bags.reading import Bag
from likeme_bags.values import Record

# Longer steps of the log times, ns, are left out: the clock was set, or nothing was recorded.
MAX_STEP = 3600 * 10**9
# 2000-01-01, ns: earlier log times are of a clock that was not set.
CLOCK_SET = 946_684_800 * 10**9
_MAX_SAMPLES = 10_000_000


def median_rate(stamps: NDArray[np.int64]) -> float:
    """The usual rate of a stream, Hz: one over the median step; 0 with fewer than two messages."""
    steps = np.diff(np.sort(stamps))
    steps = steps[steps > 0]
    return 1e9 / float(np.median(steps)) if len(steps) else 0.0


def time_jumps(stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    """Begin and end (ns) of steps in rising stamps that are to be left out, shape (n, 2).

    Those from a clock that was not set to one that was, and those of more than an hour unless the
    stream is that slow.
    """
    steps = np.diff(stamps)
    usual = 10 * float(np.median(steps)) if len(steps) else 0.0
    too_long = steps > max(MAX_STEP, usual)
    clock_set = (stamps[:-1] < CLOCK_SET) & (stamps[1:] >= CLOCK_SET)
    at = np.flatnonzero(too_long | (clock_set & (steps > MAX_STEP)))
    return np.stack([stamps[at], stamps[at + 1]], axis=1)


def sample_times(begin: int, end: int, rate: float, jumps: NDArray[np.int64]) -> NDArray[np.int64]:
    """Times (ns) at a steady rate (Hz) between two, both included, without the `jumps`.

    Each is half a step later, so that what came a little late still counts for its own step.

    Raises:
        BagError: more than ten million.
    """
    parts, total = [np.zeros(0, np.int64)], 0
    for first, last in _spans(begin, end, jumps):
        count = round((last - first) / 1e9 * rate) + 1
        if (total := total + count) > _MAX_SAMPLES:
            raise BagError(
                f'Expected at most {_MAX_SAMPLES} samples, got {(end - begin) / 1e9:.6g} s at '
                f'{rate:.6g} Hz.'
            )
        parts.append(first + np.round((np.arange(count) + 0.5) * 1e9 / rate).astype(np.int64))
    return np.concatenate(parts)


def _spans(begin: int, end: int, jumps: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """What is left of the time between two stamps."""
    for first, last in sorted(jumps.tolist()):
        if begin <= first < end:
            yield begin, first
        if begin < last:
            begin = last
    if begin <= end:
        yield begin, end


def jump_remark(topic: str, jumps: NDArray[np.int64]) -> list[str]:
    """The sentence for a user, if there are jumps."""
    if not len(jumps):
        return []
    longest = float(np.diff(jumps, axis=1).max()) / 1e9
    return [f'{topic}: log times jump {len(jumps)} times, by up to {longest:.0f} s; left out.']


def sample_and_hold(
    bag: Bag, topics: Sequence[str], times: NDArray[np.int64]
) -> Iterator[dict[str, Record]]:
    """At each time (ns, rising) the last record of every topic so far; topics without one lack."""
    last: dict[str, Record] = {}
    records = bag.records(topics)
    ahead = next(records, None)
    for time in times.tolist():
        while ahead is not None and ahead.stamp <= time:
            last[ahead.topic] = ahead
            ahead = next(records, None)
        yield dict(last)
