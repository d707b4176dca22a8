"""Reading ROS 1 bags (format 2.0): chunk by chunk from front to back, whatever the index says."""

from __future__ import annotations

import struct
from array import array
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

from likeme_bags.bag_warnings import About, Notes
from likeme_bags.byte_reader import Cursor
from likeme_bags.compression import decompress, decompress_prefix
from likeme_bags.errors import DamagedError
from likeme_bags.files import FileBytes
from likeme_bags.index import Index
from likeme_bags.limits import MAX_BLOCK, MAX_CHUNKS
from likeme_bags.ros1_connections import Connections
from likeme_bags.ros1_file import head_at, is_cut, next_chunk
from likeme_bags.ros1_format import (
    MAGIC,
    Fields,
    Op,
    record_at,
    text_of,
    time_of,
    u8,
    u32,
    u64,
)
from likeme_bags.storage import BlockCache, Channel

_METHODS = {'none': '', 'lz4': 'lz4', 'bz2': 'bz2'}


class _Chunk(NamedTuple):
    """A chunk's data: where it lies in the file, and what is needed to read it."""

    at: int
    stored: int
    size: int
    method: str


class Ros1Storage:
    """One ROS 1 bag; `fetch` gives messages as ROS 1 serialised them.

    A ROS 1 index repeats the time of every message, which tells damage from truth: bz2 and lz4
    have checksums of their own, an uncompressed chunk has none.
    """

    def __init__(self, path: Path, notes: Notes, salvage: bool = False) -> None:
        self.index = Index()
        self._notes = notes
        self._file = FileBytes(path)
        self._connections = Connections(self._file.name, notes)
        self._chunks: list[_Chunk] = []
        self._cache: BlockCache[bytes | memoryview] = BlockCache()
        self._salvage = salvage
        self._cut = -1
        # Chunks by the bag header.
        self._promised: int | None = None
        # Sizes and checksums of the chunks.
        self._marks: set[tuple[int, int]] = set()
        try:
            self._scan()
        except BaseException:
            self.close()
            raise

    @property
    def checksums(self) -> bool:
        """Whether checksums cover every message, so that a flipped bit is noticed."""
        return all(chunk.method == 'bz2' for chunk in self._chunks)

    @property
    def channels(self) -> Mapping[int, Channel]:
        """All connections that are not in doubt, by their number."""
        return self._connections.channels

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()

    def fetch(self, stamp: int, channel: int, block: int, offset: int) -> bytes | None:
        """The message at a place in a chunk."""
        try:
            return bytes(record_at(Cursor(self._data(block), offset))[1])
        except DamagedError as error:
            self._lose(str(error))
            return None

    def _lose(self, why: str) -> None:
        self._notes.lost(self._file.name, why)

    def _data(self, block: int) -> bytes | memoryview:
        data = self._cache.get(block)
        if data is None:
            chunk = self._chunks[block]
            stored = self._file.read(chunk.at, min(chunk.stored, MAX_BLOCK))
            unpack = decompress_prefix if block == self._cut else decompress
            data = unpack(stored, chunk.method, chunk.size)
            self._cache.put(block, data, len(data))
        return data

    def _scan(self) -> None:
        if self._file.read(0, len(MAGIC)) != MAGIC:
            begin = self._file.read(0, len(MAGIC))
            raise DamagedError(
                f'Expected a ROS 1 bag of format 2.0, got one that begins with {begin!r}.'
            )
        at, listed = len(MAGIC), array('Q')
        indexed = 0
        while at < self._file.size:
            try:
                fields, body, size = head_at(self._file, at)
                op = u8(fields, 'op')
                if op != Op.INDEX and indexed < len(self._chunks):
                    self._index_chunk(indexed, listed)
                    indexed, listed = len(self._chunks), array('Q')
                self._take(op, fields, body, size, listed)
                at = body + size
            except DamagedError as error:
                onward = next_chunk(self._file, at)
                self._note_damage(at, onward, str(error))
                if onward is None:
                    break
                at = onward
        if indexed < len(self._chunks):
            self._index_chunk(indexed, listed)
        self._compare()
        self._connections.drop_doubtful(self._notes.complete or self._salvage)

    def _note_damage(self, at: int, onward: int | None, why: str) -> None:
        name, size = self._file.name, self._file.size
        if onward is not None:
            sentence = f'{name} is damaged from byte {at} to {onward}: {why}'
            self._notes.loss(About.INDEX, sentence)
        elif is_cut(self._file, at):
            tell = self._notes.remark if self._salvage else self._notes.loss
            tell(About.INDEX, f'{name} ends in the middle of a record that begins at byte {at}.')
        else:
            self._notes.loss(About.INDEX, f'{name} is damaged from byte {at} of {size} on: {why}')

    def _take(self, op: int, fields: Fields, body: int, size: int, listed: array[int]) -> None:
        """Note one record; `listed` collects the index records behind a chunk."""
        if op == Op.BAG:
            self._promised = u32(fields, 'chunk_count')
            if u64(fields, 'index_pos') == 0:
                tell = self._notes.remark if self._salvage else self._notes.loss
                tell(About.INDEX, f'{self._file.name} was not closed by its writer.')
        elif op == Op.CHUNK:
            self._add_chunk(fields, body, size)
        elif op == Op.INDEX:
            self._list(fields, self._file.text(body, size), listed)
        elif op == Op.CONNECTION:
            self._connections.take(fields, self._file.text(body, size), in_chunk=False)
        elif op != Op.CHUNK_INFO:
            raise DamagedError(f'Expected a record of a bag, got one of kind {op}.')
        if body + size > self._file.size:
            raise DamagedError(f'Expected {size} bytes at {body}, got {self._file.size - body}.')

    def _compare(self) -> None:
        """Compare what was found with what the bag header promises."""
        name, found = self._file.name, len(self._chunks)
        if self._promised is None:
            self._notes.loss(About.INDEX, f'{name}: its first record, the bag header, is missing.')
        elif self._promised > found:
            self._notes.loss(
                About.INDEX, f'{name}: {found} chunks found, its header says {self._promised}.'
            )

    def _add_chunk(self, fields: Fields, body: int, size: int) -> None:
        method = _METHODS.get(text_of(fields, 'compression'))
        if method is None:
            raise DamagedError(
                f'Expected compression none, bz2 or lz4, got {fields["compression"]!r}.'
            )
        if len(self._chunks) >= MAX_CHUNKS:
            raise DamagedError(f'Expected at most {MAX_CHUNKS} chunks, got more.')
        if body + size > self._file.size:
            have = self._file.size - body
            if not self._salvage:
                self._lose(f'the last chunk was cut off after {have} of {size} bytes')
                return
            self._cut = len(self._chunks)
        self._chunks.append(_Chunk(body, size, u32(fields, 'size'), method))

    def _list(self, fields: Fields, body: bytes, listed: array[int]) -> None:
        """Add (time, connection, offset) of an index record."""
        connection, count = u32(fields, 'conn'), u32(fields, 'count')
        if len(body) != 12 * count:
            raise DamagedError(
                f'Expected {count} index entries of 12 bytes, got {len(body)} bytes.'
            )
        for seconds, nanoseconds, offset in struct.iter_unpack('<III', body):
            listed.extend((seconds * 10**9 + nanoseconds, connection, offset))

    def _index_chunk(self, number: int, listed: array[int]) -> None:
        """Index a chunk by its own records; a message its index record denies is dropped."""
        try:
            data = self._data(number)
            self._check_new(data)
        except DamagedError as error:
            self._lose(f'chunk {number} cannot be read: {error}')
            return
        promised = set(zip(listed[::3], listed[1::3], listed[2::3], strict=True))
        found, dropped = 0, 0
        cursor = Cursor(data)
        try:
            while cursor.left:
                offset = cursor.at
                fields, body = record_at(cursor)
                op = u8(fields, 'op')
                if op == Op.CONNECTION:
                    self._connections.take(fields, bytes(body), in_chunk=True)
                elif op == Op.MESSAGE:
                    entry = (time_of(fields), u32(fields, 'conn'), offset)
                    found += 1
                    if promised and entry not in promised:
                        dropped += 1
                    else:
                        self.index.add(*entry[:2], number, offset)
        except DamagedError as error:
            if number != self._cut:
                self._lose(f'chunk {number} is damaged inside: {error}')
        if dropped or (promised and found < len(promised)):
            self._lose(
                f'chunk {number} holds {found} messages, {found - dropped} of them as its index '
                f'of {len(promised)} says'
            )

    def _check_new(self, data: bytes | memoryview) -> None:
        """No recorder writes the same chunk twice, times and all."""
        mark = len(data), crc32(data)
        if len(data) and mark in self._marks:
            raise DamagedError('Expected every chunk once, got the same one again.')
        self._marks.add(mark)
