"""Pacing by a fake clock."""

from __future__ import annotations

import pytest

from likeme_arm_sim import pacer
from likeme_arm_sim.pacer import Pacer


class FakeClock:
    """A monotonic clock that only sleeping advances."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> FakeClock:
    made = FakeClock()
    monkeypatch.setattr(pacer, 'time', made)
    return made


def run(made: Pacer, begin: float, end: float, factor: float, steps: int = 100) -> None:
    """Wait after each of the steps of simulated time."""
    for step in range(1, steps + 1):
        made.wait(begin + (end - begin) * step / steps, factor)


@pytest.mark.parametrize('factor', [0.5, 1.0, 20.0])
def test_simulated_time_passes_at_its_factor(clock: FakeClock, factor: float) -> None:
    made = Pacer()
    made.wait(0.0, factor)
    run(made, 0.0, 10.0, factor)
    assert clock.now - 100.0 == pytest.approx(10.0 / factor)


@pytest.mark.parametrize(('before', 'after'), [(20.0, 1.0), (1.0, 0.1), (1.0, 20.0), (0.0, 1.0)])
def test_a_changed_factor_counts_from_its_change_on(
    clock: FakeClock, before: float, after: float
) -> None:
    made = Pacer()
    made.wait(0.0, before)
    run(made, 0.0, 100.0, before)
    changed = clock.now
    run(made, 100.0, 101.0, after)
    # The step at which the new factor is first seen does not wait.
    assert clock.now - changed == pytest.approx(1.0 / after, rel=0.02)


def test_0_never_sleeps(clock: FakeClock) -> None:
    run(Pacer(), 0.0, 100.0, 0.0)
    assert clock.now == 100.0


def test_a_stall_is_not_made_up_for(clock: FakeClock) -> None:
    made = Pacer()
    made.wait(0.0, 1.0)
    clock.now += 60.0
    run(made, 0.0, 1.0, 1.0)
    assert clock.now == pytest.approx(160.0 + 0.99)
