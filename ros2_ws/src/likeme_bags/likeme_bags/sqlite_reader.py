"""Reading rosbag2's sqlite3 files of every schema version through rosbags.

The library's own opening sets no limits, and refuses the file for one definition in a language
it does not know or one QoS profile that does not parse; so it is given an opened connection.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import apsw
import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from likeme_bags.bag_warnings import BagWarnings, Subject
from likeme_bags.errors import READ_ERRORS, BagError, DamagedError
from likeme_bags.limits import MAX_BLOCK, MAX_TOPICS
from likeme_bags.sorted_copy import sorted_copy
from likeme_bags.sqlite_salvage import readable, rows_of
from likeme_bags.storage import Channel, Storage

# Files up to this size are always checked page by page, bytes.
_CHECKED_SIZE = 2**26
# Steps of SQLite's virtual machine from one row to the next, before a query is given up: it may
# go round in circles through damaged pages.
_MAX_STEPS = 400_000_000
_VALID = "FROM messages WHERE typeof(timestamp) = 'integer' AND timestamp >= 0"
_DEFINITION = ('topic_type', 'type_description_hash', 'encoded_message_definition', 'encoding')
_TOPIC = ('name', 'type', 'serialization_format', 'offered_qos_profiles', 'type_description_hash')


class SqliteStorage(Storage):
    """One .db3 file, opened immutable: not even a journal is written beside it.

    Where the library fails, or rows are missing, the rows that can be read are copied.
    thorough: check every page, also of a large file.
    """

    channels: dict[int, Channel] = {}  # noqa: RUF012
    counts: dict[int, int] = {}  # noqa: RUF012
    # sqlite3 has none.
    checksums = False

    def __init__(self, path: Path, log: BagWarnings, thorough: bool = False) -> None:
        super().__init__(path, log)
        self._steps = 0
        try:
            self._open(readable(path, log, self._opened))
            self._read_channels()
            try:
                self._check(thorough or path.stat().st_size <= _CHECKED_SIZE)
            except READ_ERRORS as error:
                self.salvage(str(error))
        except READ_ERRORS as error:
            self.release()
            raise BagError(f'Cannot read {path.name} as a sqlite3 bag: {error}.') from None
        except BaseException:
            self.release()
            raise

    @property
    def span(self) -> tuple[int, int]:
        """Log times of the first and the last message, ns."""
        begin, end = self._rows(f'SELECT min(timestamp), max(timestamp) {_VALID}')[0]
        return begin or 0, end or 0

    def messages(
        self, connections: Collection[Connection], start: int | None, stop: int | None
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Messages in the order of log times."""
        for message in self._reader.messages(connections, start, stop):
            self._steps = 0
            yield message

    def stamps(self, channel: int) -> NDArray[np.int64]:
        """Log times of a topic's messages, ns, rising; shape (n,)."""
        rows = self._rows(f'SELECT timestamp {_VALID} AND topic_id = ? ORDER BY 1', channel)
        return np.array([row[0] for row in rows], np.int64)

    def _index_content(self) -> None:
        """Copy the rows that can be read."""
        self._reader = sorted_copy(self.connections, self._whole_rows(), self._opened)
        self._count()

    def _whole_rows(self) -> Iterator[tuple[Connection, int, bytes]]:
        """What can be read of the rows, and can be a message."""
        known = {connection.id: connection for connection in self.connections}
        for key, topic, stamp, data in rows_of(self._db, self.name, self._log):
            self._steps = 0
            if topic in known and isinstance(stamp, int) and isinstance(data, bytes):
                yield known[topic], stamp, data
            else:
                self._lose(f'row {key} has topic {topic!r} and log time {stamp!r}')

    def _open(self, path: Path) -> None:
        """Open the file within limits."""
        self._db = apsw.Connection(
            f'{path.absolute().as_uri()}?immutable=1',
            flags=apsw.SQLITE_OPEN_READONLY | apsw.SQLITE_OPEN_URI,
        )
        self._opened.callback(self._db.close)
        self._db.limit(apsw.SQLITE_LIMIT_LENGTH, MAX_BLOCK)
        self._db.set_progress_handler(self._step, 1_000_000)
        self._db.execute('PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON')
        self._reader = Sqlite3Reader(path)
        self._reader.dbconn = self._db

    def _step(self) -> bool:
        """Called by SQLite every million steps; True interrupts the query."""
        self._steps += 1_000_000
        return self._steps > _MAX_STEPS

    def _check(self, pages: bool) -> None:
        """Count rows by the index and by the table; maybe check every page."""
        fault = self._rows('PRAGMA integrity_check(1)')[0][0] if pages else 'ok'
        if fault != 'ok':
            raise DamagedError(str(fault))
        self._count()
        by_table, by_index = sum(self.counts.values()), self._rows('SELECT count(*) FROM messages')
        if by_table != by_index[0][0]:
            raise DamagedError(f'Expected {by_table} rows, its index has {by_index[0][0]}.')

    def _count(self) -> None:
        query = 'SELECT topic_id, count(*) FROM messages NOT INDEXED GROUP BY topic_id'
        self.counts = dict(self._rows(query))

    def _rows(self, query: str, *values: int) -> list[tuple[Any, ...]]:
        """All rows of a query."""
        self._steps = 0
        assert self._reader.dbconn is not None
        return list(self._reader.dbconn.execute(query, values))

    def _read_channels(self) -> None:
        topics, messages = self._columns('topics'), self._columns('messages')
        if not {'name', 'type'} <= topics or 'data' not in messages:
            raise BagError(f"Expected tables 'topics' and 'messages' in {self.name}, got none.")
        definitions = self._definitions()
        self.channels = {}
        for key, name, kind, serialization, qos, type_hash in self._texts('topics', _TOPIC):
            if not (name and kind):
                self._lose(f'topic {key!r} has no readable name or type')
                continue
            # A type may be defined in more than one way.
            text, encoding = definitions.get((kind, type_hash)) or definitions.get(
                (kind, ''), ('', '')
            )
            self.channels[key] = Channel(
                name, kind, serialization or 'cdr', qos, text, encoding, type_hash
            )
        self._reader.connections = list(self.connections)

    def _definitions(self) -> dict[tuple[str, str], tuple[str, str]]:
        """Definition and its language, by type and hash; the first of a type by '' as well."""
        found: dict[tuple[str, str], tuple[str, str]] = {}
        try:
            rows = self._texts('message_definitions', _DEFINITION)
        except READ_ERRORS as error:
            sentence = f'{self.name}: message definitions cannot be read: {error}.'
            self._log.remark(Subject.CHUNKS, sentence)
            return {}
        for _, kind, type_hash, text, encoding in rows:
            for key in ((kind, type_hash), (kind, '')) if text else ():
                found.setdefault(key, (text, encoding))
        return found

    def _columns(self, table: str) -> set[str]:
        return {str(row[1]) for row in self._rows(f'PRAGMA table_info({table})')}

    def _texts(self, table: str, columns: tuple[str, ...]) -> list[tuple[Any, ...]]:
        """Row id and texts of a table, whatever bytes they are; '' for columns it lacks."""
        have = self._columns(table)
        if columns[0] not in have:
            return []
        chosen = ', '.join(f'CAST({c} AS BLOB)' if c in have else "x''" for c in columns)
        rows = self._rows(f'SELECT rowid, {chosen} FROM {table} LIMIT {MAX_TOPICS}')
        return [
            (row[0], *((each or b'').decode('utf-8', 'replace') for each in row[1:]))
            for row in rows
        ]
