from __future__ import annotations

import errno
import os
import random
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import pytest

from likeme_arm import hold_latch
from likeme_arm.hold_latch import HISTORY, NEVER_HELD, SLOT, HoldChange, HoldLatch


@pytest.fixture
def clock() -> Iterator[int]:
    return count(1000, 10)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / 'hold'


def test_a_hold_outlives_the_process_and_so_does_a_resume(
    path: Path, clock: Iterator[int]
) -> None:
    assert HoldLatch(path, clock.__next__).state == NEVER_HELD
    held = HoldLatch(path, clock.__next__).hold('Ada', 'the cup')
    assert held == HoldChange(True, 1000, 'Ada', 'the cup')
    assert HoldLatch(path, clock.__next__).state == held
    resumed = HoldLatch(path, clock.__next__).resume('Bob', '')
    again = HoldLatch(path, clock.__next__)
    assert again.state == resumed == HoldChange(False, 1010, 'Bob', '')
    assert again.history == [held, resumed]


def test_numbers_grow_also_while_the_clock_goes_back(path: Path) -> None:
    times = iter([500, 400, 400])
    latch = HoldLatch(path, times.__next__)
    numbers = [latch.hold('', '').change, latch.resume('', '').change, latch.hold('', '').change]
    assert numbers == [500, 501, 502]


def test_a_write_that_was_cut_off_leaves_the_change_before(
    path: Path, clock: Iterator[int]
) -> None:
    latch = HoldLatch(path, clock.__next__)
    latch.hold('Ada', '')
    latch.resume('Ada', '')
    data = bytearray(path.read_bytes())
    # The newest change is in the second slot: the third of the writes.
    for damage in range(SLOT + 5, SLOT + 60):
        cut = data.copy()
        cut[damage] ^= 0x20
        path.write_bytes(cut)
        assert HoldLatch(path, clock.__next__).history == latch.history[:1]


def test_writes_that_are_cut_off_again_and_again_leave_the_change_before(
    path: Path, clock: Iterator[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    latch = HoldLatch(path, clock.__next__)
    held = latch.hold('Ada', '')
    write = os.pwrite

    def half(descriptor: int, line: bytes, offset: int) -> int:
        return write(descriptor, line[:20], offset)

    monkeypatch.setattr(hold_latch.os, 'pwrite', half)
    for _ in range(2):
        with pytest.raises(OSError, match='cut off'):
            latch.resume('Bob', '')
    assert HoldLatch(path, clock.__next__).state == held


@pytest.mark.parametrize(
    'content',
    [b'', b'{}', random.Random(0).randbytes(2 * SLOT), b' ' * (2 * SLOT)],
    ids=['empty', 'another', 'random', 'blank'],
)
def test_a_file_that_cannot_be_read_is_a_hold(
    path: Path, clock: Iterator[int], content: bytes
) -> None:
    path.write_bytes(content)
    latch = HoldLatch(path, clock.__next__)
    assert latch.state.held
    assert latch.state.reason == 'the file of the hold could not be read'
    latch.resume('Ada', '')
    assert not HoldLatch(path, clock.__next__).state.held


def test_on_a_full_disk_a_hold_counts_and_a_resume_does_not(
    path: Path, clock: Iterator[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    latch = HoldLatch(path, clock.__next__)

    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, 'No space left on device')

    monkeypatch.setattr(hold_latch.os, 'pwrite', full)
    assert latch.hold('Ada', '').held
    assert latch.problem == f'{path}: No space left on device'
    with pytest.raises(OSError, match='No space left'):
        latch.resume('Ada', '')
    assert latch.state.held
    monkeypatch.undo()
    latch.resume('Ada', '')
    assert latch.problem == ''
    assert not HoldLatch(path, clock.__next__).state.held


def test_the_history_is_bounded_and_fits(path: Path, clock: Iterator[int]) -> None:
    latch = HoldLatch(path, clock.__next__)
    for _ in range(3 * HISTORY):
        latch.hold('\U0001f916' * 500, '"\\' * 500)
    assert len(latch.history) == HISTORY
    again = HoldLatch(path, clock.__next__)
    assert again.state == latch.state
    assert again.history == latch.history[-len(again.history) :]
    assert path.stat().st_size == 2 * SLOT
