"""When the next thing is due, by a clock of the test's own."""

from __future__ import annotations

import pytest

from likeme_replay.playback_control import EndedByKeyError, Transport

SECOND = 1_000_000_000


class Clock:
    """Time that passes only while the player idles; keys that are pressed at given times."""

    def __init__(self, keys: dict[float, str] | None = None) -> None:
        self.now = 100.0
        self._keys = dict(keys or {})

    def time(self) -> float:
        return self.now

    def idle(self, seconds: float) -> None:
        self.now += seconds

    def pressed(self) -> str:
        due = [at for at in self._keys if at <= self.now - 100.0 + 1e-9]
        return ''.join(self._keys.pop(at) for at in due)


def played(clock: Clock, transport: Transport, *stamps: float) -> list[float]:
    """When each stamp (s) came, s after the beginning."""
    times = []
    for stamp in stamps:
        transport.wait(round(stamp * SECOND), clock.idle)
        times.append(round(clock.now - 100.0, 2))
    return times


@pytest.mark.parametrize(('rate', 'expected'), [(1.0, [0, 1, 3]), (2.0, [0, 0.5, 1.5])])
def test_things_come_at_the_rate(rate: float, expected: list[float]) -> None:
    clock = Clock()
    assert played(clock, Transport(rate, now=clock.time), 7, 8, 10) == expected


def test_at_rate_zero_nothing_waits() -> None:
    clock = Clock()
    assert played(clock, Transport(0.0, now=clock.time), 1, 99) == [0, 0]


def test_jumps_of_the_recorded_clock_are_left_out() -> None:
    """As from 0 to the first stamp of a clock that was set; a pause of an hour is kept."""
    clock, said = Clock(), list[str]()
    transport = Transport(2.0, now=clock.time, say=said.append)
    stamps = (0, 1_700_000_000, 1_700_000_002, 1_700_003_602, 1_700_090_000, 1_700_090_001)
    assert played(clock, transport, *stamps) == [0, 0, 1, 1801, 1801, 1801.5]
    assert said == [
        'The bag jumps by 1700000000 s; left out.',
        'The bag jumps by 86398 s; left out.',
    ]


def test_space_pauses_and_goes_on_at_the_same_rate() -> None:
    clock = Clock({0.5: ' ', 3.0: ' '})
    assert played(clock, Transport(1.0, keys=clock.pressed, now=clock.time), 0, 1, 2) == [0, 3, 4]


def test_single_steps_while_paused() -> None:
    clock = Clock({1.0: 'n', 2.0: 'nn', 9.0: ' '})
    transport = Transport(1.0, paused=True, keys=clock.pressed, now=clock.time)
    assert played(clock, transport, 0, 5, 10, 15) == [1, 2, 2, 9]


def test_a_key_ends_it() -> None:
    clock = Clock({0.2: 'q'})
    transport = Transport(1.0, keys=clock.pressed, now=clock.time)
    with pytest.raises(EndedByKeyError):
        played(clock, transport, 0, 1)
