"""The latched hold on disk: what outlives every process of the cell.

A file of two slots of fixed size, written in turn and in place: a write that is cut off leaves
the other slot, and a full disk has room for what is there already. Each slot is one line of JSON
with a CRC-32, padded with spaces.
"""

from __future__ import annotations

import json
import os
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

SLOT = 4096
#: Changes that are remembered, for a decision log that was away.
HISTORY = 16
#: Longest `by` and `reason`, so that a history fits into a slot.
TEXT_LIMIT = 80


class HoldChange(NamedTuple):
    """One hold or resume.

    Attributes:
        held: whether nothing may move since.
        change: its number: greater with each, system time in ns where that clock advances.
        by, reason: who, and why.
    """

    held: bool
    change: int
    by: str = ''
    reason: str = ''


#: Before the first hold.
NEVER_HELD = HoldChange(False, 0)
#: What a damaged file means.
DAMAGED = 'the file of the hold could not be read'


class HoldLatch:
    """Holds and resumes, each on disk before it counts.

    Attributes:
        history: the latest changes, oldest first.
        problem: why the last change is not on disk; empty if it is.
    """

    def __init__(self, path: Path, clock: Callable[[], int] = time.time_ns) -> None:
        """Read the latch, or make it. A file that cannot be read counts as a hold.

        clock: system time, ns.

        Raises:
            OSError: the file cannot be made.
        """
        self._path, self._clock = path, clock
        self.problem = ''
        self._sequence = 0
        self.history: list[HoldChange] = []
        if path.exists():
            self._read()
        else:
            self._path.write_bytes(b' ' * (2 * SLOT))
            self._write()

    @property
    def state(self) -> HoldChange:
        """The last change."""
        return self.history[-1] if self.history else NEVER_HELD

    def hold(self, by: str, reason: str) -> HoldChange:
        """Hold from now on, also if it cannot be written (see `problem`)."""
        self._add(HoldChange(True, self._next(), by[:TEXT_LIMIT], reason[:TEXT_LIMIT]))
        self._try_to_write()
        return self.state

    def resume(self, by: str, reason: str) -> HoldChange:
        """Allow motion from now on.

        Raises:
            OSError: it cannot be written: the hold stays.
        """
        before = self.history
        self._add(HoldChange(False, self._next(), by[:TEXT_LIMIT], reason[:TEXT_LIMIT]))
        if self._try_to_write():
            return self.state
        self.history = before
        raise OSError(self.problem)

    def _add(self, change: HoldChange) -> None:
        self.history = [*self.history[1 - HISTORY :], change]

    def _next(self) -> int:
        return max(self._clock(), self.state.change + 1)

    def _try_to_write(self) -> bool:
        try:
            self._write()
        except OSError as error:
            self.problem = f'{self._path}: {error.strerror or error}'
            return False
        self.problem = ''
        return True

    def _write(self) -> None:
        # A write that fails is tried again in the same slot: the other one is whole.
        sequence = self._sequence + 1
        line = _line(sequence, self.history)
        descriptor = os.open(self._path, os.O_WRONLY | os.O_CLOEXEC)
        try:
            offset = SLOT * (sequence % 2)
            if os.pwrite(descriptor, line.ljust(SLOT - 1) + b'\n', offset) != SLOT:
                raise OSError('the write was cut off')
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        self._sequence = sequence

    def _read(self) -> None:
        try:
            data = self._path.read_bytes()
        except OSError:
            data = b''
        slots = [_parsed(data[start : start + SLOT]) for start in (0, SLOT)]
        found = [slot for slot in slots if slot is not None]
        if not found:
            self._add(HoldChange(True, self._clock(), 'hold_keeper', DAMAGED))
            self._try_to_restore()
            return
        newest = max(found, key=lambda slot: int(slot['sequence']))
        self._sequence = newest['sequence']
        self.history = [HoldChange(*each) for each in newest['history']]

    def _try_to_restore(self) -> None:
        try:
            self._path.write_bytes(b' ' * (2 * SLOT))
        except OSError as error:
            self.problem = f'{self._path}: {error.strerror or error}'
            return
        self._try_to_write()


def _line(sequence: int, history: list[HoldChange]) -> bytes:
    """The text of a slot: as many of the latest changes as it has room for."""
    record = {'sequence': sequence, 'history': [list(each) for each in history]}
    text = json.dumps(record, separators=(',', ':'), ensure_ascii=False).encode()
    line = f'{zlib.crc32(text):08x} '.encode() + text
    return line if len(line) < SLOT else _line(sequence, history[1:])


def _parsed(slot: bytes) -> Any:
    """The record of a slot; None if it holds none that is whole."""
    checksum, _, text = slot.rstrip(b' \n').partition(b' ')
    if checksum != f'{zlib.crc32(text):08x}'.encode():
        return None
    record = json.loads(text)
    return record if isinstance(record, dict) else None
