"""A crash-safe writer of bags: after kill -9 all messages up to the last flush can be read.

`rosbags` closes an MCAP chunk at 1 MiB, writes the index and metadata.yaml at the end, and leaves
a sqlite3 bag of a killed process without messages. Here `flush` ends the chunk, writes index,
footer and metadata.yaml behind it, and waits for the disk; the next chunk overwrites that index.
So a killed recorder leaves a bag that other tools open, without the messages since the last
flush. A kill during a flush itself leaves a truncated end: `open_bag` reads such a file, and
`bag.sh repair` repairs it.
"""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import cast

import lz4.frame
from backports import zstd
from rosbags.interfaces import Connection
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from likeme_bags.errors import BagError
from likeme_bags.storage_writers import STORAGES, CheckedMcapWriter, SqliteWriter

#: Uncompressed bytes in a chunk, unless a flush ends it before.
CHUNK = 4 * 2**20
#: zstd's own default, fast enough for two cameras.
LEVEL = 3
#: How a bag can be packed: MCAP chunk by chunk, sqlite3 message by message, which has no lz4.
COMPRESSIONS = {'mcap': ('zstd', 'lz4', 'none'), 'sqlite3': ('zstd', 'none')}


class _OpenFile(io.BufferedWriter):
    """A file that `rosbags` may close as often as it likes."""

    def close(self) -> None:
        """Let the disk have what is written."""
        if not self.closed:
            self.flush()
            os.fsync(self.fileno())

    def really_close(self) -> None:
        """Close it."""
        super().close()


class DurableMcap(CheckedMcapWriter):
    """MCAP with chunks of any size, and an end that can be taken back."""

    chunk_size: int = CHUNK
    level: int = LEVEL

    def __init__(self, path: Path, compression: CompressionMode) -> None:
        super().__init__(path, compression)
        begun = self.bio.tell()
        self.bio.close()
        self.bio = _OpenFile(io.FileIO(self.path, 'r+b'))
        self.bio.seek(begun)
        self._end: int | None = None
        self._finishing = False
        if compression == CompressionMode.STORAGE:
            self.compressor = self._compress

    def close_chunk(self) -> None:
        """End the chunk if it is full or the file is about to be; over the end that was there."""
        if self.chunk.bio.tell() < self.chunk_size and not self._finishing:
            return
        if self._end is not None:
            # First the old end goes, so that it is never taken for the end of what follows.
            self.bio.seek(self._end)
            self.bio.truncate()
            self._end = None
        super().close_chunk()

    def close(self, version: int, metadata: str) -> None:
        """Write everything there is, with index and footer, and stay open."""
        self._finishing = True
        if self.chunk.bio.tell():
            self.close_chunk()
        self._finishing = False
        if self._end is not None:
            self.bio.seek(self._end)
            self.bio.truncate()
        self._end = self.bio.tell()
        super().close(version, metadata)
        # The checksum of the index came by a handle of its own.
        os.fsync(self.bio.fileno())

    def really_close(self) -> None:
        """Let go of the file."""
        cast(_OpenFile, self.bio).really_close()

    def pack_by_lz4(self) -> None:
        """From the next chunk on."""
        self.compression, self.compressor = 'lz4', lz4.frame.compress

    def _compress(self, data: bytes) -> bytes:
        options: dict[int, int] = {zstd.CompressionParameter.compression_level: self.level}
        if self.chunk_size > CHUNK:
            # What was seen many frames ago is found again.
            window = min(26, self.chunk_size.bit_length())
            options[zstd.CompressionParameter.window_log] = window
            options[zstd.CompressionParameter.enable_long_distance_matching] = 1
        return zstd.compress(data, options=options)


class DurableSqlite(SqliteWriter):
    """sqlite3 whose end is a commit."""

    def close(self, version: int, metadata: str) -> None:
        """Commit everything there is, and stay open."""
        self.cursor.execute('DELETE FROM metadata')
        self.cursor.execute(
            'INSERT INTO metadata(metadata_version, metadata) VALUES(?, ?)', (version, metadata)
        )
        self.conn.commit()

    def really_close(self) -> None:
        """Let go of the file."""
        self.conn.close()


class DurableWriter(Writer):
    """A rosbags Writer whose `flush` leaves a complete bag behind."""

    # What the library declares is a mapping of classes, too.
    STORAGE_PLUGINS = {  # noqa: RUF012
        StoragePlugin.SQLITE3: DurableSqlite,
        StoragePlugin.MCAP: DurableMcap,
    }

    def __init__(
        self, path: Path, storage: str = 'mcap', compression: str = 'zstd',
        custom: Mapping[str, str] = MappingProxyType({}),
    ) -> None:  # fmt: skip
        """A new bag in the folder `path`.

        Args:
            path: a folder that must not exist.
            storage: 'mcap' (compressed chunk by chunk) or 'sqlite3' (message by message).
            compression: 'zstd'; 'lz4' (MCAP alone), which is read three times as fast and packs a
                camera's noise to 78 % in place of 53 %; or 'none'.
            custom: key and value pairs for metadata.yaml.

        Raises:
            BagError: the folder exists, or the storage or its compression is none.
        """
        if storage not in STORAGES:
            raise BagError(f'Expected a storage of {" or ".join(STORAGES)}, got {storage!r}.')
        if compression not in COMPRESSIONS[storage]:
            known = ' or '.join(COMPRESSIONS[storage])
            raise BagError(f'Expected a {storage} bag packed by {known}, got {compression!r}.')
        if path.exists():
            raise BagError(f'{path} exists already: nothing is written over it.')
        super().__init__(path, version=9, storage_plugin=STORAGES[storage])
        self._lz4 = compression == 'lz4'
        if compression != 'none':
            mode = CompressionMode.STORAGE if storage == 'mcap' else CompressionMode.MESSAGE
            self.set_compression(mode, CompressionFormat.ZSTD)
        for key, value in custom.items():
            self.set_custom_data(key, value)

    def open(self) -> None:
        """Begin: from here on there is a bag on the disk, without messages at first."""
        super().open()
        if self._lz4:
            cast(DurableMcap, self.storage).pack_by_lz4()
        self.flush()

    def flush(self) -> None:
        """Make all that was written a complete bag on the disk."""
        storage = self.storage
        super().close()
        self.storage = storage
        _to_disk(self.metapath)
        _to_disk(self.path)

    def close(self) -> None:
        """Flush and let go of the files."""
        self.flush()
        assert self.storage is not None
        self.storage.really_close()  # type: ignore[attr-defined]
        self.storage = None

    def write(self, connection: Connection, timestamp: int, data: bytes | memoryview) -> None:
        """Write a message of a connection that was added here (looking it up is not for free)."""
        assert self.storage is not None, 'A writer is opened first.'
        if self.compression_mode == CompressionMode.MESSAGE:
            data = zstd.compress(data)
        self.storage.write(connection, timestamp, data)
        self.counts[connection.id] += 1
        self.min_timestamp = min(timestamp, self.min_timestamp)
        self.max_timestamp = max(timestamp, self.max_timestamp)


def _to_disk(path: Path) -> None:
    """Have the disk keep a file, or the names in a folder."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
