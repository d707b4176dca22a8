"""Writing bags through the rosbags library, topics and records as this package has them."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

import lz4.frame
from backports import zstd
from rosbags.interfaces import Connection
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from likeme_bags.errors import LIBRARY_ERRORS, BagError
from likeme_bags.storage import Attachment
from likeme_bags.storage_writers import (
    NO_HASH,
    STORAGES,
    CheckedMcapWriter,
    OwnName,
    SqliteWriter,
    hashed,
)
from likeme_bags.typestores import jazzy_definition, layout
from likeme_bags.values import Record, Topic

# metadata.yaml as Jazzy writes it.
_VERSION: Literal[9] = 9
# How a definition in IDL begins, before the name of its type.
_IDL = '=' * 80 + '\nIDL: '


class _Writer(Writer):
    # What the library declares is a mapping of classes, too.
    STORAGE_PLUGINS = {  # noqa: RUF012
        StoragePlugin.MCAP: CheckedMcapWriter,
        StoragePlugin.SQLITE3: SqliteWriter,
    }


class BagWriter:
    """A new rosbag2 folder. A context manager: index and metadata.yaml are written at its end.

    When the block is left by an exception, what was flushed stays, without an index.
    """

    def __init__(
        self,
        path: Path | str,
        storage: str = 'mcap',
        compress: bool | str = True,
        custom: Mapping[str, str] | None = None,
    ) -> None:
        """Make the folder.

        storage: 'mcap' or 'sqlite3'. compress: MCAP's chunks, by 'zstd' (or True), or by 'lz4',
        which is read faster and packs less; sqlite3 has no such thing. custom: goes into
        metadata.yaml.

        Raises:
            BagError: the folder exists, or cannot be made.
        """
        if compress not in (True, False, 'zstd', 'lz4'):
            raise BagError(f"Expected compression by 'zstd' or 'lz4', got '{compress}'.")
        if storage not in STORAGES:
            raise BagError(f"Expected storage 'mcap' or 'sqlite3', got '{storage}'.")
        self.path = Path(path)
        self._connections: dict[tuple[str, str, int], Connection] = {}
        # The first layout of every type.
        self._layouts: dict[str, str] = {}
        self._storage = storage
        try:
            self._writer = _Writer(self.path, version=_VERSION, storage_plugin=STORAGES[storage])
            if compress and storage == 'mcap':
                self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            for key, value in (custom or {}).items():
                self._writer.set_custom_data(key, value)
            self._writer.open()
        except OSError as error:
            raise BagError(f'Cannot write {self.path}: {error.strerror}.') from None
        except LIBRARY_ERRORS as error:
            raise BagError(str(error)) from None
        file = self._writer.storage
        if compress and isinstance(file, CheckedMcapWriter):
            file.compressor = zstd.compress
            if compress == 'lz4':
                file.compression, file.compressor = 'lz4', lz4.frame.compress

    def add(self, topic: Topic) -> None:
        """Announce a topic; its definition, hash and QoS are kept. Twice does no harm.

        A definition that is missing is taken from Jazzy's types where they have the type.
        """
        if topic.key in self._connections:
            return
        self._check_definition(topic)
        text, digest = topic.definition, topic.type_hash
        if not text:
            text, known = jazzy_definition(topic.type)
            digest = digest or known
        if topic.encoding.endswith('idl') and not text.startswith(_IDL):
            # By this the library tells the language.
            text = f'{_IDL}{topic.type}\n{text}'
        connection = self._writer.add_connection(
            # The library refuses what equals a topic it has: those of two definitions do.
            OwnName(topic.name) if topic.schema else topic.name,
            topic.type,
            msgdef=text,
            rihs01=digest or NO_HASH,
            offered_qos_profiles=topic.qos,
        )
        connection = connection._replace(topic=topic.name)
        if not digest:
            connection = hashed(connection)
        # metadata.yaml is written from this list.
        self._writer.connections[-1] = connection
        self._connections[topic.key] = connection

    def _check_definition(self, topic: Topic) -> None:
        """Refuse what a sqlite3 bag cannot say."""
        own = layout(topic)
        known = self._layouts.setdefault(topic.type, own)
        if self._storage == 'sqlite3' and own and known and own != known:
            raise BagError(
                f'Expected one definition of {topic.type}, got two: a sqlite3 bag cannot hold '
                'them, mcap can.'
            )

    def attach(self, attachment: Attachment) -> bool:
        """Write an attachment or metadata record; False: the storage has no such thing."""
        file = self._writer.storage
        if not isinstance(file, CheckedMcapWriter):
            return False
        with self._raising_bag_errors():
            file.add_attachment(attachment.parts())
        return True

    def write(self, record: Record) -> None:
        """Write one record of a topic that was added."""
        connection = self._connections.get(record.key)
        if connection is None:
            raise BagError(f'Expected a topic that was added, got {record.topic} ({record.type}).')
        with self._raising_bag_errors():
            self._writer.write(connection, record.stamp, record.data)

    def flush(self) -> None:
        """Close the pending chunk, so that what was written survives the end of this process."""
        file = self._writer.storage
        if isinstance(file, CheckedMcapWriter | SqliteWriter):
            with self._raising_bag_errors():
                file.flush()

    def close(self) -> None:
        """Write index and metadata.yaml."""
        with self._raising_bag_errors():
            self._writer.close()

    @contextmanager
    def _raising_bag_errors(self) -> Iterator[None]:
        """Raise errors of the disk as BagError."""
        try:
            yield
        except (OSError, sqlite3.Error) as error:
            raise BagError(f'Cannot write {self.path}: {error}.') from None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None:
            self.close()
        else:
            # A disk that is full makes this fail, too; the first error counts.
            with suppress(OSError, sqlite3.Error):
                self._writer.abort()
