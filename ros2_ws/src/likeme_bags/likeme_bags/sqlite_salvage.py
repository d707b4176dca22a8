"""Opening a sqlite3 file that may be cut, damaged, or left behind with its journal."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from likeme_bags.bag_warnings import About, Notes
from likeme_bags.errors import BagError
from likeme_bags.limits import MAX_BLOCK

_MAGIC = b'SQLite format 3\0'
# Where the file's first page keeps the number of pages (sqlite.org/fileformat).
_PAGES_AT = 28
# Statements of SQLite's virtual machine before a query on a damaged file is given up.
_STEPS = 400_000_000


class Head(NamedTuple):
    """What the first 100 bytes say."""

    page_size: int
    # As many pages as there should be; 0: not said.
    pages: int
    # Bytes the file really has.
    size: int

    @property
    def cut(self) -> bool:
        """Whether the file ends before its last page does."""
        return self.size % self.page_size != 0 or self.size < self.pages * self.page_size


class Patience:
    """Interrupts a query that goes round in circles through damaged pages."""

    def __init__(self) -> None:
        self._steps = 0

    def renew(self) -> None:
        """Before every query."""
        self._steps = 0

    def tick(self) -> bool:
        """Called by SQLite every million steps; True interrupts."""
        self._steps += 1_000_000
        return self._steps > _STEPS


def open_sqlite(
    path: Path, notes: Notes, stack: ExitStack, patience: Patience
) -> sqlite3.Connection:
    """A connection that only reads; nothing beside the file is made or touched.

    A journal left behind is played into a temporary copy. Of a cut file a copy of its whole pages
    is read: SQLite would take what is missing for zeros.

    Raises:
        BagError: it is not a sqlite3 file.
        sqlite3.Error: SQLite does not accept it.
    """
    head = read_head(path)
    journals = [path.with_name(path.name + end) for end in ('-wal', '-journal')]
    if any(journal.exists() for journal in journals):
        notes.remark(About.INDEX, f'{path.name} was not closed: its journal is still there.')
        folder = _folder(stack)
        for each in (path, *journals):
            if each.exists():
                shutil.copyfile(each, folder / each.name)
        target = f'{folder / path.name}'
    elif head.cut:
        should = head.pages * head.page_size or 'whole pages'
        notes.loss(About.INDEX, f'{path.name} was cut: {head.size} bytes, expected {should}.')
        target = f'{_whole_pages(path, head, _folder(stack)).as_uri()}?immutable=1'
    else:
        if head.pages and head.size > head.pages * head.page_size:
            notes.remark(About.INDEX, f'{path.name} is longer than its {head.pages} pages.')
        target = f'{path.absolute().as_uri()}?immutable=1'
    db = sqlite3.connect(target, uri=target.startswith('file:'), check_same_thread=False)
    stack.callback(db.close)
    db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_BLOCK)
    db.text_factory = lambda raw: raw.decode('utf-8', 'replace')
    db.set_progress_handler(patience.tick, 1_000_000)
    db.execute('PRAGMA trusted_schema = OFF')
    db.execute('PRAGMA cell_size_check = ON')
    return db


def read_head(path: Path) -> Head:
    """Raises BagError when it is not a sqlite3 file."""
    try:
        with path.open('rb') as file:
            head = file.read(100)
        size = path.stat().st_size
    except OSError as error:
        raise BagError(f'Cannot open {path}: {error.strerror}.') from None
    if len(head) < 100 or head[:16] != _MAGIC:
        raise BagError(f'Expected a sqlite3 bag, got {path.name} beginning with {head[:16]!r}.')
    page = int.from_bytes(head[16:18], 'big')
    page = 65536 if page == 1 else page
    if page < 512 or page & (page - 1):
        raise BagError(f'Expected pages of 512 to 65536 bytes in {path.name}, got {page}.')
    # The number of pages counts only when both change counters agree.
    said = int.from_bytes(head[_PAGES_AT : _PAGES_AT + 4], 'big')
    return Head(page, said if head[24:28] == head[92:96] else 0, size)


def _whole_pages(path: Path, head: Head, folder: Path) -> Path:
    """A copy that ends with a page, and says so: then pages beyond it are errors, not zeros."""
    copy = folder / path.name
    shutil.copyfile(path, copy)
    pages = head.size // head.page_size
    with copy.open('r+b') as file:
        file.truncate(pages * head.page_size)
        file.seek(24)
        counter = file.read(4)
        file.write(pages.to_bytes(4, 'big'))
        file.seek(92)
        file.write(counter)
    return copy


def _folder(stack: ExitStack) -> Path:
    return Path(stack.enter_context(TemporaryDirectory(prefix='likeme-bag-')))
