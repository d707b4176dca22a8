"""Reading a ROS 1 bag through rosbags, which is given an index that holds and checked chunks.

The library's own opening does not compare its index with the file, and decompresses whatever a
chunk unpacks to.
"""

from __future__ import annotations

from collections import OrderedDict, defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import NamedTuple, cast
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection, ConnectionExtRosbag1
from rosbags.rosbag1 import Reader
from rosbags.rosbag1.reader import Chunk, IndexData

from likeme_bags.bag_warnings import BagWarnings
from likeme_bags.byte_reader import ByteReader
from likeme_bags.compression import decompress, decompress_prefix
from likeme_bags.errors import LIBRARY_ERRORS, DamagedError
from likeme_bags.file_bytes import FileBytes
from likeme_bags.limits import MAX_CACHE, MAX_MESSAGES
from likeme_bags.ros1_format import Ros1Op, fields_of, number, time_of
from likeme_bags.ros1_scan import ChunkPlace, scan
from likeme_bags.storage import Channel, Storage


class _Entry(NamedTuple):
    """An index entry that is ordered by time, then as written; the library's by time alone."""

    time: int
    chunk_pos: int
    offset: int


class Ros1Storage(Storage):
    """One ROS 1 bag; messages as ROS 1 serialised them.

    bz2 has checksums; lz4 as ROS 1 writes it and uncompressed chunks have none.

    thorough: index every chunk by its content at once, rather than by the index records behind
    it. to_repair: also take what can be had of a chunk that was cut.
    """

    def __init__(
        self, path: Path, log: BagWarnings, thorough: bool = False, to_repair: bool = False
    ) -> None:
        super().__init__(path, log, to_repair)
        self._library = Reader(path)
        # The chunks last read, by their file offset.
        self._cache: OrderedDict[int, bytes] = OrderedDict()
        self._known: dict[int, Connection] = {}
        self._doubtful: set[int] = set()
        self._entries: dict[int, list[_Entry]] = defaultdict(list)
        self._file = FileBytes(path)
        self._opened.callback(self._file.close)
        try:
            self._scan = scan(self._file, log, to_repair)
            self._library.bio = self._opened.enter_context(path.open('rb'))
            self._library.chunks = {
                chunk.offset: Chunk(chunk.stored, chunk.at, self._decompressor(chunk))
                for chunk in self._scan.chunks
            }
            if thorough or not self._can_use_indexes():
                self._salvaged = True
                self._known.clear()
                self._index_content()
        except BaseException:
            self.release()
            raise

    @property
    def connections(self) -> Collection[Connection]:
        """All connections, for `messages`."""
        return self._library.connections

    @property
    def channels(self) -> Mapping[int, Channel]:
        """All connections by their number."""
        return {
            c.id: Channel(
                c.topic,
                c.msgtype,
                'ros1',
                'latched' if cast(ConnectionExtRosbag1, c.ext).latching else '',
                c.msgdef.data,
                'ros1msg',
                c.digest,
            )
            for c in self.connections
        }

    @property
    def counts(self) -> Mapping[int, int]:
        """Messages by number of their connection."""
        return {key: len(index) for key, index in self._entries.items()}

    @property
    def span(self) -> tuple[int, int]:
        """Log times of the first and the last message, ns."""
        entries = [index for index in self._entries.values() if index]
        return min(index[0].time for index in entries), max(index[-1].time for index in entries)

    @property
    def checksums(self) -> bool:
        """Whether checksums cover every message, so that a flipped bit is noticed."""
        return all(chunk.method == 'bz2' for chunk in self._scan.chunks)

    def messages(
        self, connections: Collection[Connection], start: int | None, stop: int | None
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Messages in the order of log times."""
        return self._library.messages(connections, start, stop)

    def stamps(self, channel: int) -> NDArray[np.int64]:
        """Log times of a connection's messages, ns, rising; shape (n,)."""
        return np.array([entry.time for entry in self._entries.get(channel, ())], np.int64)

    def _decompressor(self, chunk: ChunkPlace) -> Callable[[bytes], bytes]:
        """Gives what is in a chunk, from its stored bytes unless it is known."""

        def decompressed(stored: bytes) -> bytes:
            data = self._cache.pop(chunk.offset, None)
            if data is None:
                cut = self._scan.cut and chunk is self._scan.chunks[-1]
                unpack = decompress_prefix if cut else decompress
                data = unpack(stored, chunk.method, chunk.size)
            self._cache[chunk.offset] = data
            while len(self._cache) > 1 and sum(map(len, self._cache.values())) > MAX_CACHE:
                self._cache.popitem(last=False)
            return data

        return decompressed

    def _can_use_indexes(self) -> bool:
        """Index chunks by the index records behind them, if nothing speaks against these."""
        found = self._scan
        listed = [sum(count for _, count, _ in chunk.indexes) for chunk in found.chunks]
        if not found.whole or sum(listed) != found.message_count or not all(listed):
            return False
        for record in found.connections:
            self._learn(record)
        seen: set[int] = set()
        for chunk in found.chunks:
            connections = {connection for connection, _, _ in chunk.indexes}
            if connections - seen:
                # The first chunk with a connection describes it, too, maybe under a checksum.
                seen |= connections
                try:
                    for _ in self._records_in(self._content(chunk)):
                        pass
                except DamagedError:
                    return False
            for stamp, connection, offset in chunk.listed(self._file):
                self._entries[connection].append(_Entry(stamp, chunk.offset, offset))
        self._use()
        return True

    def _index_content(self) -> None:
        """Index every chunk by what is in it, up to its first damaged record."""
        self._entries.clear()
        marks: set[tuple[int, int]] = set()
        for place, chunk in enumerate(self._scan.chunks):
            try:
                data = self._content(chunk)
                mark = len(data), crc32(data)
                if data and mark in marks:
                    raise DamagedError('Expected every chunk once, got the same one again.')
                marks.add(mark)
            except DamagedError as error:
                self._lose(f'chunk {place} cannot be read: {error}')
                continue
            self._index_chunk(place, chunk, data)
        # The index at the end has no checksum: where something is wrong, it is not believed more
        # than the messages.
        if self._log.complete or self._to_repair or not self.checksums:
            for record in self._scan.connections:
                self._learn(record)
        self._use()

    def _index_chunk(self, place: int, chunk: ChunkPlace, data: bytes) -> None:
        """Index a chunk by its own records; a message its index record denies is dropped."""
        promised = chunk.listed(self._file)
        found, dropped = 0, 0
        try:
            for entry in self._records_in(data):
                found += 1
                if promised and entry not in promised:
                    dropped += 1
                else:
                    stamp, connection, offset = entry
                    self._entries[connection].append(_Entry(stamp, chunk.offset, offset))
        except DamagedError as error:
            if not (self._scan.cut and chunk is self._scan.chunks[-1]):
                self._lose(f'chunk {place} is damaged inside: {error}')
        if dropped or (promised and found < len(promised)):
            self._lose(
                f'chunk {place} holds {found} messages, {found - dropped} of them as its index '
                f'of {len(promised)} says'
            )
        if sum(self.counts.values()) > MAX_MESSAGES:
            raise DamagedError(f'Expected at most {MAX_MESSAGES} messages in a bag.')

    def _content(self, chunk: ChunkPlace) -> bytes:
        """What is in a chunk."""
        stored = self._file.read(chunk.at, chunk.stored)
        return self._library.chunks[chunk.offset].decompressor(stored)

    def _records_in(self, data: bytes) -> Iterator[tuple[int, int, int]]:
        """(time in ns, connection, offset) of the messages of a chunk; learns its connections."""
        reader = ByteReader(data)
        while reader.left:
            offset = reader.at
            fields = fields_of(reader.block())
            reader.block()
            op = number(fields, 'op', 1)
            if op == Ros1Op.CONNECTION:
                self._learn(data[offset : reader.at])
            elif op == Ros1Op.MESSAGE:
                yield time_of(fields), number(fields, 'conn', 4), offset

    def _use(self) -> None:
        """Have the library read by this index from now on."""
        for key in sorted(self._doubtful):
            topic = self._known.pop(key).topic
            self._lose(f'connection {key} ({topic}) is described twice and differently')
        self._doubtful.clear()
        for index in self._entries.values():
            index.sort()
        self._library.connections = list(self._known.values())
        self._library.indexes = cast(
            dict[int, list[IndexData]], {key: self._entries.get(key, []) for key in self._known}
        )

    def _learn(self, record: bytes) -> None:
        """Keep a connection record; of one that is described in two ways nothing is believed."""
        parser = Reader(self._path)
        parser.bio = BytesIO(record)
        try:
            connection = parser.read_connection()
        except LIBRARY_ERRORS as error:
            raise DamagedError(f'Expected a connection: {error}') from None
        if self._known.setdefault(connection.id, connection)[1:4] != connection[1:4]:
            self._doubtful.add(connection.id)
