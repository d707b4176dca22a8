"""Writing bags through the rosbags library, with what it leaves out.

rosbags writes no checksums into MCAP chunks; without one, a flipped bit in an image goes unseen. A
type whose definition nobody has is written with none rather than refused.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from os import SEEK_END
from pathlib import Path
from types import TracebackType
from typing import Literal, Self
from zlib import crc32

import lz4.frame
from backports import zstd
from rosbags.interfaces import Connection
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.rosbag2.storage_mcap import McapWriter, Schema, write_channel, write_schema
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer

from likeme_bags.errors import LIBRARY_ERRORS, BagError
from likeme_bags.typestores import described
from likeme_bags.values import Record, Topic

STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
# metadata.yaml as Jazzy writes it.
_VERSION: Literal[9] = 9
# From the start of a chunk record to its checksum: op code, length, two times, size.
_TO_CRC = 9 + 24
# From a file's end back to the summary's checksum: that, and the magic bytes.
_FROM_SUMMARY_CRC = 4 + 8
# Stands for "no hash" on the way through rosbags, which insists on one.
_NO_HASH = 'none'


class CheckedMcapWriter(McapWriter):
    """rosbags' MCAP writer with a checksum in every chunk and the topics in every chunk.

    So each chunk can be read by itself, whatever happens to the others.
    """

    # A chunk was begun that does not describe the topics yet.
    _fresh = False

    def add_msgtype(self, connection: Connection) -> None:
        """A type without a definition gets a schema without a language, as MCAP wants it."""
        if connection.msgdef.data:
            super().add_msgtype(connection)
            return
        self.schemas.append(Schema(len(self.schemas) + 1, connection.msgtype, '', ''))
        write_schema(self.chunk.bio, self.schemas[-1])

    def write(self, connection: Connection, timestamp: int, data: bytes | memoryview) -> None:
        """One message; in a new chunk after all types and topics."""
        if self._fresh:
            self._fresh = False
            for schema in self.schemas:
                write_schema(self.chunk.bio, schema)
            for channel in self.channels:
                write_channel(self.chunk.bio, channel, self.schemas)
        super().write(connection, timestamp, data)

    def close_chunk(self) -> None:
        """Write the pending chunk, then its checksum into the place left for it."""
        with self.chunk.bio.getbuffer() as records:
            crc = crc32(records)
        start = self.bio.tell()
        super().close_chunk()
        self._fresh = True
        end = self.bio.tell()
        self.bio.seek(start + _TO_CRC)
        self.bio.write(crc.to_bytes(4, 'little'))
        self.bio.seek(end)

    def close(self, version: int, metadata: str) -> None:
        """Finish the file, then write the summary's checksum into its footer."""
        super().close(version, metadata)
        with self.path.open('r+b') as file:
            end = file.seek(-_FROM_SUMMARY_CRC, SEEK_END)
            file.seek(end - 16)
            begin = int.from_bytes(file.read(8), 'little')
            file.seek(begin)
            crc, left = 0, end - begin
            while left and (data := file.read(min(left, 2**20))):
                crc, left = crc32(data, crc), left - len(data)
            file.write(crc.to_bytes(4, 'little'))

    def flush(self) -> None:
        """Hand everything written so far to the system."""
        if self.chunk.msgs:
            self.close_chunk()
        self.bio.flush()


class HonestSqliteWriter(Sqlite3Writer):
    """rosbags' sqlite3 writer; what is not known stays empty."""

    def add_msgtype(self, connection: Connection) -> None:
        """Definitions that nobody has are left out."""
        if connection.msgdef.data:
            super().add_msgtype(_hashed(connection))

    def add_connection(self, connection: Connection, offered_qos_profiles: str) -> None:
        """A topic."""
        super().add_connection(_hashed(connection), offered_qos_profiles)

    def flush(self) -> None:
        """Commit."""
        self.conn.commit()


def _hashed(connection: Connection) -> Connection:
    return connection._replace(digest='') if connection.digest == _NO_HASH else connection


class _Writer(Writer):
    # What the library declares is a mapping of classes, too.
    STORAGE_PLUGINS = {  # noqa: RUF012
        StoragePlugin.MCAP: CheckedMcapWriter,
        StoragePlugin.SQLITE3: HonestSqliteWriter,
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
        self._connections: dict[tuple[str, str], Connection] = {}
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
        if compress and isinstance(file, McapWriter):
            file.compressor = zstd.compress
            if compress == 'lz4':
                file.compression, file.compressor = 'lz4', lz4.frame.compress

    def add(self, topic: Topic) -> None:
        """Announce a topic; its definition, hash and QoS are kept. Twice does no harm.

        A definition that is missing is taken from Jazzy's types where they have the type.
        """
        if (topic.name, topic.type) in self._connections:
            return
        text, digest = topic.definition, topic.type_hash
        if not text:
            text, known = described(topic.type)
            digest = digest or known
        connection = self._writer.add_connection(
            topic.name,
            topic.type,
            msgdef=text,
            rihs01=digest or _NO_HASH,
            offered_qos_profiles=topic.qos,
        )
        if not digest:
            # metadata.yaml is written from this list.
            connection = _hashed(connection)
            self._writer.connections[-1] = connection
        self._connections[topic.name, topic.type] = connection

    def write(self, record: Record) -> None:
        """Write one record of a topic that was added."""
        connection = self._connections.get((record.topic, record.type))
        if connection is None:
            raise BagError(f'Expected a topic that was added, got {record.topic} ({record.type}).')
        with self._spoken():
            self._writer.write(connection, record.stamp, record.data)

    def flush(self) -> None:
        """Close the pending chunk, so that what was written survives the end of this process."""
        file = self._writer.storage
        if isinstance(file, CheckedMcapWriter | HonestSqliteWriter):
            with self._spoken():
                file.flush()

    def close(self) -> None:
        """Write index and metadata.yaml."""
        with self._spoken():
            self._writer.close()

    @contextmanager
    def _spoken(self) -> Iterator[None]:
        """A full disk and the like, as one sentence."""
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
