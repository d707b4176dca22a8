"""When the next message is due, by a simulated clock."""

from __future__ import annotations

import pytest

from likeme_replay.playback_control import EndedByKeyError, PlaybackControl

SECOND = 1_000_000_000


class Clock:
    """Time that passes only while the player idles, and keys pressed at given times."""

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


def played(clock: Clock, control: PlaybackControl, *stamps: float) -> list[float]:
    """When each stamp (s) came, s after the beginning."""
    times = []
    for stamp in stamps:
        control.wait(round(stamp * SECOND), clock.idle)
        times.append(round(clock.now - 100.0, 2))
    return times


@pytest.mark.parametrize(('rate', 'expected'), [(1.0, [0, 1, 3]), (2.0, [0, 0.5, 1.5])])
def test_messages_come_at_the_rate(rate: float, expected: list[float]) -> None:
    clock = Clock()
    assert played(clock, PlaybackControl(rate, now=clock.time), 7, 8, 10) == expected


def test_at_rate_zero_nothing_waits() -> None:
    clock = Clock()
    assert played(clock, PlaybackControl(0.0, now=clock.time), 1, 99) == [0, 0]


def test_jumps_of_the_recorded_clock_are_left_out_and_long_waits_announced() -> None:
    """As from 0 to the first stamp of a clock that was set, and back by a day."""
    clock, messages = Clock(), list[str]()
    control = PlaybackControl(2.0, now=clock.time, notify=messages.append)
    stamps = (0, 1_700_000_000, 1_700_000_002, 1_700_003_600, 1_699_900_000, 1_699_900_001)
    assert played(clock, control, *stamps) == [0, 0, 1, 1800, 1800, 1800.5]
    assert messages == [
        'The recorded clock jumps by 1700000000 s; the jump is left out.',
        'The next message is due in 1799 s.',
        'The recorded clock jumps by -103600 s; the jump is left out.',
    ]


def test_small_steps_back_do_not_shift_the_rest() -> None:
    clock, messages = Clock(), list[str]()
    control = PlaybackControl(1.0, now=clock.time, notify=messages.append)
    assert played(clock, control, 7.0, 8.0, 7.5, 9.0) == [0, 1, 1, 2]
    assert messages == []


def test_space_pauses_and_goes_on_at_the_same_rate() -> None:
    clock = Clock({0.5: ' ', 3.0: ' '})
    assert played(clock, PlaybackControl(1.0, keys=clock.pressed, now=clock.time), 0, 1, 2) == [
        0,
        3,
        4,
    ]


def test_single_steps_while_paused() -> None:
    clock = Clock({1.0: 'n', 2.0: 'nn', 9.0: ' '})
    control = PlaybackControl(1.0, paused=True, keys=clock.pressed, now=clock.time)
    assert played(clock, control, 0, 5, 10, 15) == [1, 2, 2, 9]


def test_a_key_ends_it() -> None:
    clock = Clock({0.2: 'q'})
    control = PlaybackControl(1.0, keys=clock.pressed, now=clock.time)
    with pytest.raises(EndedByKeyError):
        played(clock, control, 0, 1)
