"""SQLite files that can be read alone: read-only file systems, folders and files."""

from __future__ import annotations

import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlalchemy.engine import URL

#: What SQLite keeps beside a database: changes that are not in it yet, or not for good.
JOURNALS = ('-wal', '-journal')


def file_of(url: URL) -> Path | None:
    """The file of an SQLite database; None: another database, in memory, or SQLite's own URI."""
    in_memory = url.database in (None, '', ':memory:')
    if url.get_backend_name() != 'sqlite' or in_memory or 'uri' in url.query:
        return None
    return Path(str(url.database)).resolve()


def is_read_only(path: Path) -> bool:
    """Whether SQLite cannot write to a database, or not beside it."""
    beside = os.access(path.parent, os.W_OK) or _has_log(path, os.W_OK)
    return path.exists() and not (beside and os.access(path, os.W_OK))


def readable_in_place(path: Path) -> bool:
    """Whether SQLite can read a database where it is, and leaves nothing beside it.

    For a database with a write-ahead log SQLite makes an index of the log beside it, also to read.
    It does without writing where both are there, as they are while somebody else writes.
    """
    return not is_read_only(path) or _has_log(path, os.R_OK)


def _has_log(path: Path, access: int) -> bool:
    """Whether the write-ahead log and its index are there and may be used so."""
    return all(os.access(f'{path}{suffix}', access) for suffix in ('-wal', '-shm'))


def copy_in_memory(path: Path) -> sqlite3.Connection:
    """A database as a copy in memory that cannot be written to, journals included."""
    memory = sqlite3.connect(':memory:', check_same_thread=False)
    with TemporaryDirectory() as folder:
        for suffix in ('', *JOURNALS):
            part = Path(f'{path}{suffix}')
            if part.exists():
                shutil.copyfile(part, Path(folder, part.name))
        with closing(sqlite3.connect(Path(folder, path.name))) as copy:
            copy.backup(memory)
    memory.execute('PRAGMA query_only=ON')
    return memory
