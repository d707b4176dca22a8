"""Errors of the stores, injected where they are written."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence

from likeme_arm.motion_journal import JournalError, MotionJournal, MotionRecord
from likeme_inference.experience.decision_log import DecisionLog
from likeme_inference.experience.store_error import StoreError

Written = Callable[[str, dict[str, object]], None]


class StoreFaults:
    """Wraps the writing methods of decision log and journal in this process.

    Attributes:
        problem: why the decision log cannot be written now; empty: it can.
        full: whether the journal cannot be written either.
        on_event: told before and after each append, by the kinds of its entries.
        on_written: told of each entry that was written.
    """

    def __init__(self) -> None:
        self.problem, self.full = '', False
        self.on_event: Callable[[str], None] = lambda _: None
        self.on_written: Written = lambda _kind, _data: None
        self._append, self._begin, self._end = (
            DecisionLog.append, MotionJournal.begin, MotionJournal.end
        )  # fmt: skip

    def install(self) -> None:
        """Take the place of the methods."""
        faults = self

        def append(log: DecisionLog, run: str, entries: Sequence[tuple[str, str]]) -> int:
            if faults.problem:
                raise StoreError(faults.problem)
            kinds = sorted({kind for kind, _ in entries})
            for kind in kinds:
                faults.on_event(f'before {kind}')
            number = faults._append(log, run, entries)
            for kind, text in entries:
                faults.on_written(kind, json.loads(text))
            for kind in kinds:
                faults.on_event(f'after {kind}')
            return number

        def begin(journal: MotionJournal, record: MotionRecord) -> MotionRecord | None:
            faults.check_journal()
            return faults._begin(journal, record)

        def end(journal: MotionJournal, record: MotionRecord) -> None:
            faults.check_journal()
            faults._end(journal, record)

        # Of the classes in this process alone.
        for kind, method in ((DecisionLog, append), (MotionJournal, begin), (MotionJournal, end)):
            setattr(kind, method.__name__, method)

    def check_journal(self) -> None:
        """Fail if the journal cannot be written.

        Raises:
            JournalError: the disk is full.
        """
        if self.full:
            raise JournalError('database or disk is full')
