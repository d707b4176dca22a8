"""The rosbags library's writers of storage files, with checksums and a schema per definition.

rosbags writes no checksums into MCAP chunks, so that a flipped bit in an image is not noticed, and
one schema for all definitions of a type. A type without a definition is written without one.
"""

from __future__ import annotations

from collections.abc import Iterable
from os import SEEK_END
from pathlib import Path
from zlib import crc32

from rosbags.interfaces import Connection
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.rosbag2.storage_mcap import McapWriter, Schema, write_channel, write_schema
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer

STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
# From the start of a chunk record to its checksum: op code, length, two times, size.
_TO_CRC = 9 + 24
# From a file's end back to the summary's checksum: that, and the magic bytes.
_FROM_SUMMARY_CRC = 4 + 8
# Stands for "no hash" on the way through rosbags, which insists on one.
NO_HASH = 'none'


class OwnName(str):
    """A name that equals only itself, where the library would take two of a name for one."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return self is other

    __hash__ = str.__hash__


class CheckedMcapWriter(McapWriter):
    """rosbags' MCAP writer with a checksum in every chunk and the topics in every chunk.

    So each chunk can be read by itself, whatever happens to the others.
    """

    # A chunk was begun that does not describe the topics yet.
    _fresh = False

    def __init__(self, path: Path, compression: CompressionMode) -> None:
        super().__init__(path, compression)
        self._names: dict[tuple[str, str], OwnName] = {}

    def add_msgtype(self, connection: Connection) -> None:
        """The library calls this once a type; here each definition of a type has its schema."""

    def add_connection(self, connection: Connection, offered_qos_profiles: str) -> None:
        """A topic, and the schema of its definition; one that nobody has is without a language."""
        text = connection.msgdef.data
        name = self._names.get((connection.msgtype, text))
        if name is None:
            name = self._names[connection.msgtype, text] = OwnName(connection.msgtype)
            if text:
                super().add_msgtype(connection._replace(msgtype=name))
            else:
                self.schemas.append(Schema(len(self.schemas) + 1, name, '', ''))
                write_schema(self.chunk.bio, self.schemas[-1])
        super().add_connection(connection._replace(msgtype=name), offered_qos_profiles)

    def add_attachment(self, record: Iterable[bytes]) -> None:
        """An attachment or a metadata record of another file, between the chunks of this one."""
        if self.chunk.msgs:
            self.close_chunk()
        self.bio.writelines(record)

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


class SqliteWriter(Sqlite3Writer):
    """rosbags' sqlite3 writer; what is not known stays empty."""

    def add_msgtype(self, connection: Connection) -> None:
        """Definitions that nobody has are left out."""
        if connection.msgdef.data:
            super().add_msgtype(hashed(connection))

    def add_connection(self, connection: Connection, offered_qos_profiles: str) -> None:
        """A topic."""
        super().add_connection(hashed(connection), offered_qos_profiles)

    def flush(self) -> None:
        """Commit."""
        self.conn.commit()


def hashed(connection: Connection) -> Connection:
    """The same connection, its hash empty where none is known."""
    return connection._replace(digest='') if connection.digest == NO_HASH else connection
