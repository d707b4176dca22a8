"""The requests to move that a driver accepted, on disk before anything moves.

They make a request count once, and a motion whose driver was killed known as lost.
"""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from likeme_core.outcomes import Actor, MotionOutcome

#: Requests that are remembered.
KEPT = 1000
LOST_MESSAGE = 'The driver ended while this motion was under way: the arm may have moved.'


class MotionRecord(NamedTuple):
    """A request to move.

    Attributes:
        id: unique across runs.
        actor: who moves.
        world, object, action: label of the world, and names in it.
        outcome: None while it is under way.
        message: how it ended, in one sentence.
        started, finished: ROS time of the driver, ns; 0 if nothing moved.
    """

    id: str
    actor: Actor
    world: str
    object: str
    action: str
    outcome: MotionOutcome | None = None
    message: str = ''
    started: int = 0
    finished: int = 0

    @property
    def refusal(self) -> str:
        """Why another request with this id is refused."""
        if self.outcome is None:
            return f'Request {self.id} is under way: nothing was started.'
        return (
            f'Request {self.id} was carried out before, it ended as {self.outcome.name}: nothing '
            'was started.'
        )


class JournalError(Exception):
    """The journal cannot be read or written; the message says where and why."""


class MotionJournal:
    """An SQLite file of requests. Every method may be called from any thread.

    Attributes:
        lost: requests that an earlier run of the driver left under way; ended as LOST now.
    """

    def __init__(self, path: Path) -> None:
        """Open or make the file, and end as LOST what an earlier run left under way.

        Raises:
            JournalError: it cannot be opened or written, or is no journal.
        """
        self._path, self._lock, self._read_only = path, threading.Lock(), False
        with self._guarded():
            self._open()
            self._database.execute('PRAGMA journal_mode=WAL')
            self._database.execute(
                'CREATE TABLE IF NOT EXISTS motion (number INTEGER PRIMARY KEY, id TEXT UNIQUE, '
                'actor INTEGER, world TEXT, object TEXT, action TEXT, outcome INTEGER, '
                'message TEXT, started INTEGER, finished INTEGER)'
            )
            under_way = self._select('WHERE outcome IS NULL')
        self.lost = [
            record._replace(outcome=MotionOutcome.LOST, message=LOST_MESSAGE)
            for record in under_way
        ]
        for record in self.lost:
            self.end(record)

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._database.close()

    def begin(self, record: MotionRecord) -> MotionRecord | None:
        """Keep a request; the earlier one with this id, if there was one, and then nothing else.

        Raises:
            JournalError: it cannot be written.
        """
        with self._guarded():
            row = (record.id, record.actor, record.world, record.object, record.action)
            added = self._database.execute(
                'INSERT OR IGNORE INTO motion '
                '(id, actor, world, object, action, message, started, finished) VALUES '
                "(?, ?, ?, ?, ?, '', 0, 0)",
                row,
            )
            if not added.rowcount:
                return self._select('WHERE id = ?', record.id)[0]
            self._database.execute(
                'DELETE FROM motion WHERE number <= (SELECT max(number) FROM motion) - ?', (KEPT,)
            )
            return None

    def end(self, record: MotionRecord) -> None:
        """Keep how a request ended.

        Raises:
            JournalError: it cannot be written; after a restart the motion will count as lost.
        """
        assert record.outcome is not None, 'An ended motion has an outcome.'
        with self._guarded():
            self._database.execute(
                'UPDATE motion SET outcome = ?, message = ?, started = ?, finished = ? '
                'WHERE id = ?',
                (int(record.outcome), record.message, record.started, record.finished, record.id),
            )

    def find(self, request_id: str) -> MotionRecord | None:
        """The request of an id; None if none is known.

        Raises:
            JournalError: the file cannot be read.
        """
        with self._guarded():
            found = self._select('WHERE id = ?', request_id)
        return found[0] if found else None

    def _select(self, condition: str, *values: str) -> list[MotionRecord]:
        rows = self._database.execute(
            'SELECT id, actor, world, object, action, outcome, message, started, finished '
            f'FROM motion {condition} ORDER BY number',
            values,
        )
        return [
            MotionRecord(
                name, Actor(actor), world, item, action,
                None if outcome is None else MotionOutcome(outcome), message, started, finished,
            )
            for name, actor, world, item, action, outcome, message, started, finished in rows
        ]  # fmt: skip

    def _open(self) -> None:
        self._read_only = False
        self._database = sqlite3.connect(
            self._path, timeout=1.0, isolation_level=None, check_same_thread=False
        )
        self._database.execute('PRAGMA synchronous=FULL')

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        with self._lock:
            try:
                if self._read_only:
                    # SQLite keeps a file read-only that was so when it was opened.
                    self._database.close()
                    self._open()
                yield
            except (sqlite3.Error, ValueError) as error:
                self._read_only = 'readonly' in str(error)
                raise JournalError(f'{self._path}: {error}.') from error
