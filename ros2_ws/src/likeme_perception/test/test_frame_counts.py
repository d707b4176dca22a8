"""Statistics of frames."""

from __future__ import annotations

import pytest

from likeme_perception.frame_counts import FrameCounts, FrameRate, Throttle


def test_rates_are_since_the_previous_call() -> None:
    counts = FrameCounts(now=10.0)
    for _ in range(30):
        counts.read(work=0.010, latency=0.020)
    counts.drop('size', 'Too small.', now=10.5)
    assert counts.rate(now=12.0) == FrameRate(15.0, 1)
    assert counts.rate(now=13.0) == FrameRate(0.0, 0)
    assert counts.received == 31


def test_drops_are_logged_at_most_every_5_s() -> None:
    counts = FrameCounts(now=0.0)
    assert counts.drop('size', 'Too small.', 1.0) == (
        'Frame dropped (size): Too small; 1 dropped so far.'
    )
    assert counts.drop('encoding', 'Odd.', 5.9) is None
    assert counts.drop('size', 'Too small.', 6.0) == (
        'Frame dropped (size): Too small; 3 dropped so far.'
    )
    described = counts.described()
    assert described == {'dropped: encoding': '1', 'dropped: size': '2'}


def test_latencies_are_reported_as_median_and_99th_percentile() -> None:
    counts = FrameCounts(now=0.0)
    for k in range(101):
        counts.read(work=0.001 * k, latency=0.002 * k)
    described = counts.described()
    assert described['processing time p50 (ms)'] == '50.0'
    assert described['processing time p99 (ms)'] == '99.0'
    assert described['latency p50 (ms)'] == '100.0'


@pytest.mark.parametrize(('stamp', 'due'), [(1.19, False), (1.21, True), (0.5, True)])
def test_a_throttle_uses_stamps_and_restarts_when_they_go_back(stamp: float, due: bool) -> None:
    throttle = Throttle(period=0.2)
    assert throttle.due(1_000_000_000)
    assert throttle.due(round(stamp * 1e9)) is due
