"""The decision log: entries in a database, chained by hashes, added and never changed.

Each entry's hash covers all of it and the hash of the entry before. What the chain cannot show is
that its newest entries were cut off, or that all of it was written anew: for that the newest hash,
the head, is to be kept elsewhere (`log.sh verify --head`).
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from sqlalchemy import func, insert, inspect, select
from sqlalchemy.engine import Connection, Row
from sqlalchemy.exc import IntegrityError
from sqlalchemy.sql import Select

from likeme_inference.experience.database import (
    FOR_WRITING,
    open_engine,
    refusing,
    shown,
    url_of,
)
from likeme_inference.experience.log_schema import log_entries as table
from likeme_inference.experience.log_schema import log_metadata
from likeme_inference.experience.store_error import StoreError

#: `previous` of the first entry.
NO_HASH = '0' * 64
#: Its file in the state folder of a cell.
LOG_FILE = 'decision_log.sqlite'
#: s to wait for other writers.
LOCK_TIMEOUT = 1.0
BATCH = 500
#: Attempts when another writer was first (databases other than SQLite).
ATTEMPTS = 5


class LogEntry(NamedTuple):
    """One entry; see log_schema."""

    number: int
    time: int
    run: str
    kind: str
    text: str
    previous: str
    hash: str

    @property
    def data(self) -> Any:
        """What `text` says.

        Raises:
            StoreError: it is no JSON.
        """
        try:
            return json.loads(self.text)
        except (ValueError, TypeError) as error:
            raise StoreError(
                f'Entry {self.number} of the decision log cannot be read: {error}.'
            ) from error

    @property
    def intact(self) -> bool:
        """Whether the entry is what was written."""
        try:
            return self.hash == hash_of(*self[:-1])
        except TypeError:
            return False


def hash_of(number: int, when: int, run: str, kind: str, text: str, previous: str) -> str:
    """SHA-256 of an entry.

    Raises:
        TypeError: a value that is neither a number nor a text.
    """
    canonical = json.dumps([number, when, run, kind, text, previous], separators=(',', ':'))
    return hashlib.sha256(canonical.encode('ascii')).hexdigest()


class LogCheck(NamedTuple):
    """Result of checking a log.

    Attributes:
        entries: number of entries before the first wrong one.
        head: hash of the last of them.
        problem: what is wrong, in one sentence; empty: nothing.
    """

    entries: int
    head: str
    problem: str = ''


class DecisionLog:
    """A decision log in a database; several processes may each open it and append."""

    def __init__(
        self, place: str, create: bool = True, lock_timeout: float = LOCK_TIMEOUT
    ) -> None:
        """Open a log.

        Args:
            place: path of an SQLite file, or a database URL; that of an experience store or new.
            create: if it does not exist.
            lock_timeout: to wait for other writers, s.

        Raises:
            StoreError: see database.open_engine; or there is no log in it, without `create`.
        """
        self._url, self._lock_timeout = url_of(place), lock_timeout
        self._engine = open_engine(self._url, create, lock_timeout)
        self._has_table = False
        if not create and not self._there():
            raise StoreError(f'{self.place}: there is no decision log yet.')

    @property
    def place(self) -> str:
        """Path or URL, without passwords."""
        return shown(self._url)

    def close(self) -> None:
        """Close the connections."""
        self._engine.dispose()

    def append(self, run: str, entries: Sequence[tuple[str, str]]) -> int:
        """Add entries in one transaction; the number of the last one.

        Args:
            run: of the writing process.
            entries: kind and text of each.

        Raises:
            StoreError: nothing was written: locked, read-only, no space left.
        """
        with refusing(self._url, self._lock_timeout):
            for _ in range(ATTEMPTS - 1):
                try:
                    return self._append(run, entries)
                except IntegrityError:
                    # Another writer took the number.
                    continue
            return self._append(run, entries)

    def entries(
        self, kinds: Sequence[str] = (), last: int | None = None, *holding: str
    ) -> Iterator[LogEntry]:
        """Entries in their order, as they are.

        Args:
            kinds: only of these; empty: of all.
            last: only so many, the newest.
            holding: only those whose text has all of these in it.

        Raises:
            StoreError: the database cannot be read.
        """
        query = select(table).order_by(table.c.number.desc() if last else table.c.number)
        query = query.where(table.c.kind.in_(kinds)) if kinds else query
        for part in holding:
            query = query.where(table.c.text.contains(part, autoescape=True))
        if last:
            yield from reversed(list(self._read(query.limit(last))))
        else:
            yield from self._read(query)

    def newest(self, kind: str, *holding: str) -> LogEntry | None:
        """The newest entry of a kind whose text has all of `holding` in it.

        Raises:
            StoreError: the database cannot be read, or the entry is not what was written.
        """
        for entry in self.entries([kind], 1, *holding):
            if not entry.intact:
                raise StoreError(
                    f'{self.place}: entry {entry.number} is not what was written: '
                    'see log.sh verify.'
                )
            return entry
        return None

    def verify(self, head: str = '') -> LogCheck:
        """Check the chain, and that `head`, noted earlier, is in it.

        head: the first digits of a hash suffice.

        Raises:
            StoreError: the database cannot be read.
        """
        number, before, found = 0, NO_HASH, not head
        try:
            for entry in self._read(select(table).order_by(table.c.number)):
                wrong = _wrong(entry, number + 1, before)
                if wrong:
                    return LogCheck(number, before, wrong)
                number, before = entry.number, entry.hash
                found = found or before.startswith(head)
        except StoreError as error:
            if 'decode' not in str(error):
                raise
            return self._check_each(number, before)
        if not found:
            lost = f'The log was cut off or replaced: none of its {number} entries is the head '
            return LogCheck(number, before, f'{lost}{head}.')
        return LogCheck(number, before)

    def _check_each(self, number: int, before: str) -> LogCheck:
        """Check the entries after `number` one at a time, up to one that is no text."""
        while True:
            try:
                entry = next(self._read(select(table).where(table.c.number == number + 1)), None)
            except StoreError:
                unreadable = f'Entry {number + 1} cannot be read: it is no text in UTF-8.'
                return LogCheck(number, before, unreadable)
            if entry is None:
                return LogCheck(number, before, f'Entry {number + 1} is missing.')
            wrong = _wrong(entry, number + 1, before)
            if wrong:
                return LogCheck(number, before, wrong)
            number, before = entry.number, entry.hash

    def _read(self, query: Select[Any]) -> Iterator[LogEntry]:
        if not self._there():
            return
        with refusing(self._url, self._lock_timeout), self._engine.connect() as connection:
            for row in connection.execution_options(yield_per=BATCH).execute(query):
                yield _entry(row)

    def _there(self) -> bool:
        """Whether there is a log in the database."""
        if not self._has_table:
            with refusing(self._url, self._lock_timeout), self._engine.connect() as connection:
                self._has_table = inspect(connection).has_table(table.name)
        return self._has_table

    def _append(self, run: str, entries: Sequence[tuple[str, str]]) -> int:
        with self._engine.execution_options(begin=FOR_WRITING).begin() as connection:
            if not self._has_table:
                log_metadata.create_all(connection)
            number, before = _head(connection)
            rows = []
            for kind, text in entries:
                number, values = number + 1, (time.time_ns(), run, kind, text, before)
                entry = LogEntry(number, *values, hash=hash_of(number, *values))
                rows.append(entry._asdict())
                before = entry.hash
            connection.execute(insert(table), rows)
        self._has_table = True
        return number


def _head(connection: Connection) -> tuple[int, str]:
    newest = select(func.max(table.c.number)).scalar_subquery()
    row = connection.execute(
        select(table.c.number, table.c.hash).where(table.c.number == newest)
    ).first()
    return (0, NO_HASH) if row is None else (row.number, row.hash)


def _entry(row: Row[Any]) -> LogEntry:
    return LogEntry(**row._mapping)


def _wrong(entry: LogEntry, number: int, before: str) -> str:
    """What is wrong with an entry that should be `number` and follow the hash `before`."""
    if entry.number != number:
        return f'Entry {number} is missing: the next one is {entry.number}.'
    if not entry.intact:
        return f'Entry {number} is not what was written: its hash does not fit.'
    if entry.previous != before:
        return f'Entry {number} does not continue the one before it: one of them was replaced.'
    return ''
