"""A temporary copy of messages that are read by their log times: what does not fit into memory."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from rosbags.interfaces import Connection
from rosbags.rosbag2 import CompressionMode
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader, Sqlite3Writer


def sorted_copy(
    connections: Iterable[Connection],
    messages: Iterable[tuple[Connection, int, bytes]],
    opened: ExitStack,
) -> Sqlite3Reader:
    """A sqlite3 file of these messages, written and read by rosbags.

    opened: what is closed with the bag; the copy is removed then.
    """
    writer = Sqlite3Writer(temporary_folder(opened), CompressionMode.NONE)
    for connection in connections:
        writer.add_connection(connection, '')
    for connection, stamp, data in messages:
        writer.write(connection, stamp, data)
    writer.close(9, '')
    reader = Sqlite3Reader(writer.path)
    reader.open()
    opened.callback(reader.close)
    return reader


def temporary_folder(opened: ExitStack) -> Path:
    """A folder that is removed when `opened` is closed."""
    return Path(opened.enter_context(TemporaryDirectory(prefix='likeme-bag-')))
