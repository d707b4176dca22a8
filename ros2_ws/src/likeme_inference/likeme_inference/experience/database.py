"""Opening and checking the database of an experience store."""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import create_engine, event, insert, inspect, select
from sqlalchemy.engine import URL, Connection, Engine, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, SQLAlchemyError
from sqlalchemy.pool import QueuePool

from likeme_inference.experience.schema import SCHEMA_VERSION, about, metadata
from likeme_inference.experience.sqlite_file import (
    copy_in_memory,
    file_of,
    is_read_only,
    readable_in_place,
)
from likeme_inference.experience.store_error import StoreError

#: The value of the engine's option `begin` for a transaction that will write.
FOR_WRITING = 'BEGIN IMMEDIATE'
#: s between two attempts while the database is locked.
_AGAIN = 0.05


def url_of(place: str) -> URL:
    """A database URL, or a path as that of an SQLite file.

    Raises:
        StoreError: it is neither.
    """
    if '://' not in place:
        try:
            return URL.create('sqlite', database=str(Path(place).expanduser().resolve()))
        except RuntimeError as error:
            raise StoreError(f'Expected the path of a store, got {place!r}: {error}') from None
    try:
        return make_url(place)
    except ArgumentError:
        raise StoreError(
            f'Expected a path or a URL like postgresql://host/name, got {place!r}.'
        ) from None


def shown(url: URL) -> str:
    """A URL as text: the path of an SQLite file, no passwords."""
    if url.get_backend_name() == 'sqlite' and url.database:
        return url.database
    return url.render_as_string(hide_password=True)


def open_engine(url: URL, create: bool, patience: float) -> Engine:
    """An engine on a database that holds the tables of this schema version.

    Args:
        url: see url_of.
        create: make the tables in an empty or absent database.
        patience: s to wait for others' locks.

    Raises:
        StoreError: absent, locked, damaged, of another version, or something else's database.
    """
    _check_file(url, create)
    try:
        # The interface of SQLAlchemy 2, which 1.4 has by this name.
        engine = create_engine(url, future=True, **_engine_options(url, patience))
    except (NoSuchModuleError, ModuleNotFoundError, ArgumentError) as error:
        raise StoreError(f'{shown(url)}: no driver for this database: {error}.') from None
    if url.get_backend_name() == 'sqlite':
        _speak_sqlite(engine)
        _open_as_it_is(engine, file_of(url))
    with refusing(url, patience):
        _patiently(lambda: _prepare(engine, url, create), patience)
    return engine


@contextmanager
def refusing(url: URL, patience: float) -> Iterator[None]:
    """Turn database errors into a StoreError with one sentence."""
    try:
        yield
    except DBAPIError as error:
        raise StoreError(_sentence(url, ' '.join(str(error.orig).split()), patience)) from error
    except SQLAlchemyError as error:
        raise StoreError(f'{shown(url)}: {" ".join(str(error).split())}.') from error
    except OSError as error:
        raise StoreError(f'{shown(url)} cannot be read: {error.strerror}.') from error


def _sentence(url: URL, reason: str, patience: float) -> str:
    where = shown(url)
    if 'locked' in reason:
        return f'{where} is locked: somebody else has been writing for more than {patience:g} s.'
    if 'not a database' in reason:
        return f'{where}: expected an SQLite database, got a file of another kind.'
    if 'readonly' in reason:
        return f'{where} cannot be written to: the file or its folder is read-only.'
    if 'malformed' in reason or 'corrupt' in reason:
        return f'{where} is damaged ({reason}): nothing was changed.'
    return f'{where}: {reason.rstrip(".")}.'


def _check_file(url: URL, create: bool) -> None:
    """SQLite would make any file that is asked for, and says little where it cannot."""
    path = file_of(url)
    if path is None:
        return
    if path.is_dir() or not path.parent.is_dir():
        kind = 'a folder' if path.is_dir() else f'no folder {path.parent}'
        raise StoreError(f'{path}: expected a database file, got {kind}.')
    if not create and not path.exists():
        raise StoreError(f'{path}: nothing is recorded there yet.')
    if not path.exists() and not os.access(path.parent, os.W_OK):
        raise StoreError(f'{path} cannot be made: its folder is read-only.')
    if path.exists() and not os.access(path, os.R_OK):
        raise StoreError(f'{path} cannot be read: permission denied.')


def is_writable(url: URL) -> bool:
    """Whether it is no SQLite file that can be read alone."""
    path = file_of(url)
    return path is None or not is_read_only(path)


def check_writable(url: URL) -> None:
    """Refuse a database that can be read alone, before there is something to write.

    Raises:
        StoreError: it is an SQLite file that may not be written to, or in such a folder.
    """
    if not is_writable(url):
        raise StoreError(_sentence(url, 'readonly', 0))


def _engine_options(url: URL, patience: float) -> dict[str, Any]:
    if url.get_backend_name() != 'sqlite':
        return {}
    if file_of(url) is None:
        return {'connect_args': {'timeout': patience}}
    # Connections are kept, and serve all threads: SQLAlchemy 2 does so unasked, 1.4 does not.
    wanted = {'timeout': patience, 'check_same_thread': False}
    return {'connect_args': wanted, 'poolclass': QueuePool}


def _speak_sqlite(engine: Engine) -> None:
    """Transactions as SQLite means them, kept through a power-off; writers queue for theirs.

    The driver would begin a transaction at the first write only: what was read before could be old
    by then, and the upgrade of the lock fails at once instead of waiting.
    """

    @event.listens_for(engine, 'connect')
    def on_connect(connection: Any, _: Any) -> None:
        connection.isolation_level = None
        connection.execute('PRAGMA synchronous=FULL')

    @event.listens_for(engine, 'begin')
    def on_begin(connection: Connection) -> None:
        begin = connection.get_execution_options().get('begin', 'BEGIN')
        if begin:
            connection.exec_driver_sql(begin)


def _open_as_it_is(engine: Engine, path: Path | None) -> None:
    """Look at each new connection whether the file can be written to.

    SQLite opens what it may only read for reading, and keeps that connection so when the file has
    become writable, and others beside it: all are closed when a write was refused.
    """
    if path is None:
        return

    @event.listens_for(engine, 'do_connect')
    def on_do_connect(*_: Any) -> sqlite3.Connection | None:
        return None if readable_in_place(path) else copy_in_memory(path)

    @event.listens_for(engine, 'handle_error')
    def on_error(context: Any) -> None:
        if 'readonly' in str(context.original_exception):
            # A cursor that the exception keeps would keep the file open.
            if context.execution_context is not None:
                context.execution_context.cursor.close()
            context.is_disconnect = True
            engine.dispose()


def _patiently(act: Any, patience: float) -> None:
    """Changing SQLite's journal does not wait for locks by itself."""
    deadline = time.monotonic() + patience
    while True:
        try:
            act()
            return
        except DBAPIError as error:
            if 'locked' not in str(error.orig) or time.monotonic() > deadline:
                raise
            time.sleep(_AGAIN)


def _prepare(engine: Engine, url: URL, create: bool) -> None:
    with engine.connect() as connection:
        found = _version(connection, url)
    if found is None and not create:
        raise StoreError(f'{shown(url)}: nothing is recorded there yet.')
    if found is None:
        _create(engine, url)
    elif found != SCHEMA_VERSION:
        age = 'newer software' if found > SCHEMA_VERSION else 'older software'
        raise StoreError(
            f'{shown(url)}: expected schema version {SCHEMA_VERSION}, got {found}: it was written '
            f'by {age}, and is left as it is.'
        )
    elif url.get_backend_name() == 'sqlite':
        _check_sound(engine, url)


def _version(connection: Connection, url: URL) -> int | None:
    """The schema's version; None in an empty database."""
    tables = inspect(connection).get_table_names()
    if about.name in tables:
        versions = connection.execute(select(about.c.schema_version)).scalars().all()
        if len(versions) != 1:
            raise StoreError(
                f'{shown(url)}: expected one schema version, got {len(versions)}: it is left as '
                'it is.'
            )
        return int(versions[0])
    if tables:
        raise StoreError(
            f'{shown(url)}: expected experience or an empty database, got one of other tables '
            f'({", ".join(sorted(tables)[:3])}).'
        )
    return None


def _create(engine: Engine, url: URL) -> None:
    if url.get_backend_name() == 'sqlite':
        # Readers and the writer do not wait for one another. A property of the file from now on.
        # SQLite does not change it within a transaction.
        with engine.execution_options(begin='').connect() as connection:
            connection.exec_driver_sql('PRAGMA journal_mode=WAL')
    with engine.execution_options(begin=FOR_WRITING).begin() as connection:
        # Somebody else may have been first.
        if _version(connection, url) is None:
            metadata.create_all(connection)
            connection.execute(insert(about).values(schema_version=SCHEMA_VERSION))


def _check_sound(engine: Engine, url: URL) -> None:
    with engine.connect() as connection:
        said = connection.exec_driver_sql('PRAGMA quick_check(1)').scalar()
    if said != 'ok':
        raise StoreError(f'{shown(url)} is damaged ({said}): nothing was changed.')
