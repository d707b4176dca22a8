"""A sqlite3 file as far as it can be read: with its journal, cut, or with damaged pages."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import apsw

from likeme_bags.bag_warnings import BagWarnings, Subject
from likeme_bags.errors import READ_ERRORS, BagError
from likeme_bags.sorted_copy import temporary_folder

_MAGIC = b'SQLite format 3\0'
# By row id: in a damaged schema the column `id` may no longer stand for it.
_SCAN = 'SELECT rowid, topic_id, timestamp, data FROM messages WHERE rowid > ? ORDER BY rowid'
# Less than every row id.
_FIRST = -(2**63)

Row = tuple[Any, ...]


def readable(path: Path, log: BagWarnings, opened: ExitStack) -> Path:
    """The file, or a temporary copy that SQLite reads without writing beside it.

    A journal left behind is played into the copy. Of a cut file the copy has the whole pages:
    SQLite would take what is missing for zeros.

    Raises:
        BagError: it is not a sqlite3 file.
    """
    with path.open('rb') as file:
        head = file.read(100)
    page = int.from_bytes(head[16:18], 'big')
    page = 65536 if page == 1 else page
    if len(head) < 100 or head[:16] != _MAGIC or page < 512 or page & (page - 1):
        raise BagError(f'Expected a sqlite3 bag, got {path.name} beginning with {head[:18]!r}.')
    journals = [path.with_name(path.name + end) for end in ('-wal', '-journal')]
    if any(journal.exists() for journal in journals):
        log.remark(Subject.INDEX, f'{path.name} was not closed: its journal is still there.')
        return _with_journal(path, journals, temporary_folder(opened), log)
    # The number of pages counts only when both change counters agree (sqlite.org/fileformat).
    pages = int.from_bytes(head[28:32], 'big') if head[24:28] == head[92:96] else 0
    size = path.stat().st_size
    if size % page or size < pages * page:
        should = pages * page or 'whole pages'
        log.loss(Subject.INDEX, f'{path.name} was cut: {size} bytes, expected {should}.')
        return _whole_pages(path, size // page, page, temporary_folder(opened))
    if pages and size > pages * page:
        log.remark(Subject.INDEX, f'{path.name} is longer than its {pages} pages.')
    return path


def _with_journal(path: Path, journals: list[Path], folder: Path, log: BagWarnings) -> Path:
    for each in (path, *journals):
        if each.exists():
            shutil.copyfile(each, folder / each.name)
    try:
        with closing(sqlite3.connect(folder / path.name)) as db:
            db.execute('PRAGMA trusted_schema = OFF')
            db.execute('PRAGMA journal_mode = DELETE').fetchall()
            db.execute('SELECT count(*) FROM sqlite_master').fetchall()
    except sqlite3.Error as error:
        log.loss(Subject.INDEX, f'The journal of {path.name} cannot be played: {error}.')
    return folder / path.name


def _whole_pages(path: Path, pages: int, page: int, folder: Path) -> Path:
    """A copy that ends with a page, and says so: then pages beyond it are errors, not zeros."""
    copy = folder / path.name
    shutil.copyfile(path, copy)
    with copy.open('r+b') as file:
        file.truncate(pages * page)
        file.seek(24)
        counter = file.read(4)
        file.write(pages.to_bytes(4, 'big'))
        file.seek(92)
        file.write(counter)
    return copy


def rows_of(db: apsw.Connection, name: str, log: BagWarnings) -> Iterator[Row]:
    """Id, topic, log time and data of rows by rising id.

    Those on a damaged page lie together, and are warned of and stepped over.
    """
    last: int | None = _FIRST
    while last is not None:
        try:
            for row in db.execute(_SCAN, (last,)):
                if row[0] <= last:
                    log.loss(Subject.CHUNKS, f'{name} is damaged: its row ids are not in order.')
                    return
                last = row[0]
                yield row
            return
        except READ_ERRORS as error:
            log.loss(Subject.CHUNKS, f'{name}: rows behind {max(last, 0)} are damaged: {error}.')
        last = _readable_after(db, max(last, 0))


def _readable_after(db: apsw.Connection, base: int) -> int | None:
    """The smallest id above `base` behind which a row can be read; None: there is none."""

    def can_read(key: int) -> bool:
        try:
            return bool(list(db.execute(f'{_SCAN} LIMIT 1', (key,))))
        except READ_ERRORS:
            return False

    step = 1
    while not can_read(base + step):
        step *= 2
        if step > 2**40:
            return None
    low, high = base + step // 2, base + step
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if can_read(middle) else (middle, high)
    return high
