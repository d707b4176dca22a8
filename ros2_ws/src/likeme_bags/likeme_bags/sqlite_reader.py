"""Reading rosbag2's sqlite3 files of every schema version, as far as they are whole."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from likeme_bags.bag_warnings import About, Notes
from likeme_bags.errors import BagError
from likeme_bags.index import Index
from likeme_bags.limits import MAX_TOPICS
from likeme_bags.sqlite_salvage import Patience, open_sqlite
from likeme_bags.storage import Channel

# By row id: in a damaged schema the column `id` may no longer stand for it.
_SCAN = 'SELECT rowid, topic_id, timestamp FROM messages WHERE rowid > ? ORDER BY rowid LIMIT ?'
# Files up to this size are always checked page by page, bytes.
_CHECKED_SIZE = 2**26
# Less than every row id.
_FIRST = -(2**63)
# Rows asked for at once while scanning.
_ROWS = 4096


class SqliteStorage:
    """One .db3 file, opened immutable: not even a journal is written beside it."""

    def __init__(self, path: Path, notes: Notes, thorough: bool = False) -> None:
        self.index = Index()
        self.channels: dict[int, Channel] = {}
        self._notes = notes
        self._name = path.name
        self._patience = Patience()
        self._stack = ExitStack()
        try:
            self._db = open_sqlite(path, notes, self._stack, self._patience)
            self._read_channels()
            if thorough or path.stat().st_size <= _CHECKED_SIZE:
                self._check_pages()
            self._read_index()
        except (sqlite3.Error, ValueError, OverflowError, OSError, MemoryError) as error:
            self.close()
            raise BagError(f'Cannot read {path.name} as a sqlite3 bag: {error}.') from None
        except BaseException:
            self.close()
            raise

    @property
    def checksums(self) -> bool:
        """Whether checksums cover every message, so that a flipped bit is noticed."""
        return False

    def close(self) -> None:
        """Let go of the file."""
        self._stack.close()

    def fetch(self, stamp: int, channel: int, block: int, offset: int) -> bytes | None:
        """The message with a row id; None, with a note, when it cannot be read."""
        self._patience.renew()
        try:
            row = self._db.execute(
                'SELECT topic_id, timestamp, data FROM messages WHERE rowid = ?', (offset,)
            ).fetchone()
        except (sqlite3.Error, OverflowError, MemoryError) as error:
            self._lose(f'row {offset} cannot be read: {error}')
            return None
        if row is None or row[:2] != (channel, stamp) or not isinstance(row[2], bytes):
            self._lose(f'row {offset} is not what the index says')
            return None
        return row[2]

    def _lose(self, why: str) -> None:
        self._notes.lost(self._name, why)

    def _columns(self, table: str) -> set[str]:
        return {row[1] for row in self._db.execute(f'PRAGMA table_info({table})')}

    def _read_channels(self) -> None:
        have = self._columns('topics')
        if not {'name', 'type'} <= have or 'data' not in self._columns('messages'):
            raise BagError(
                f"Expected the tables 'topics' and 'messages' in {self._name}, got none."
            )
        wanted = ('serialization_format', 'offered_qos_profiles', 'type_description_hash')
        columns = ', '.join(name if name in have else "''" for name in wanted)
        definitions = self._definitions()
        rows = self._db.execute(
            f'SELECT rowid, name, type, {columns} FROM topics LIMIT {MAX_TOPICS}'
        )
        for key, name, kind, serialization, qos, type_hash in rows:
            if not (isinstance(key, int) and isinstance(name, str) and isinstance(kind, str)):
                self._lose(f'topic {key!r} has no readable name or type')
                continue
            text, encoding = definitions.get(kind, ('', ''))
            self.channels[key] = Channel(
                name, kind, str(serialization or 'cdr'), str(qos), text, encoding, str(type_hash)
            )

    def _definitions(self) -> dict[str, tuple[str, str]]:
        """Definition text and its language by type; from schema version 4 on."""
        if 'encoded_message_definition' not in self._columns('message_definitions'):
            return {}
        try:
            rows = self._db.execute(
                'SELECT topic_type, encoded_message_definition, encoding FROM message_definitions '
                f'LIMIT {MAX_TOPICS}'
            ).fetchall()
        except (sqlite3.Error, MemoryError) as error:
            self._notes.remark(
                About.CHUNKS, f'{self._name}: message definitions cannot be read: {error}.'
            )
            return {}
        return {str(kind): (str(text), str(encoding)) for kind, text, encoding in rows if text}

    def _check_pages(self) -> None:
        self._patience.renew()
        try:
            first = self._db.execute('PRAGMA quick_check(1)').fetchone()[0]
        except (sqlite3.Error, MemoryError) as error:
            first = error
        if first != 'ok':
            self._notes.loss(
                About.CHUNKS, f'{self._name} is damaged: {str(first).splitlines()[-1]}.'
            )

    def _read_index(self) -> None:
        """All rows in the order of their ids; ids that cannot be read are stepped over."""
        for key, topic, stamp in self._rows():
            if not (isinstance(topic, int) and isinstance(stamp, int) and stamp >= 0):
                self._lose(f'row {key} has topic {topic!r} and log time {stamp!r}')
            elif topic not in self.channels:
                self._lose(f'row {key} belongs to topic {topic}, which is not in the file')
            else:
                self.index.add(stamp, topic, 0, key)

    def _rows(self) -> Iterator[tuple[Any, Any, Any]]:
        """All rows that can be read. Those on a damaged page lie together and are stepped over."""
        last, size = _FIRST, _ROWS
        while True:
            rows = self._after(last, size)
            if rows is None and size > 1:
                size = 1
                continue
            if rows is None:
                self._notes.loss(
                    About.CHUNKS, f'{self._name}: rows behind {max(last, 0)} are damaged.'
                )
                onward = self._readable_after(last)
                if onward is None:
                    return
                last = onward
                continue
            if not rows:
                return
            ids = [row[0] for row in rows]
            if ids != sorted(set(ids)) or ids[0] <= last:
                sentence = f'{self._name} is damaged: its row ids are not in order.'
                self._notes.loss(About.CHUNKS, sentence)
                return
            yield from rows
            last, size = ids[-1], min(size * 2, _ROWS)

    def _after(self, last: int, size: int) -> list[tuple[Any, Any, Any]] | None:
        """Up to `size` rows with greater ids; None when one of them cannot be read."""
        self._patience.renew()
        try:
            return self._db.execute(_SCAN, (last, size)).fetchall()
        except (sqlite3.Error, OverflowError, MemoryError):
            return None

    def _readable_after(self, last: int) -> int | None:
        """The smallest id above `last` behind which a row can be read; None: there is none."""
        base, step = max(last, 0), 1
        while not self._after(base + step, 1):
            step *= 2
            if step > 2**40:
                return None
        low, high = base + step // 2, base + step
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if self._after(middle, 1) else (middle, high)
        return high
