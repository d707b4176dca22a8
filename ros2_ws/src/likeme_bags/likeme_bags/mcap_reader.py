"""Reading an MCAP file: fast by its message index, exactly wherever that cannot be trusted."""

from __future__ import annotations

from pathlib import Path

from likeme_bags.bag_warnings import About, Notes
from likeme_bags.compression import decompress_prefix
from likeme_bags.errors import DamagedError
from likeme_bags.files import FileBytes
from likeme_bags.index import MAX_STAMP, Index
from likeme_bags.limits import MAX_BLOCK
from likeme_bags.mcap_format import (
    PREFIX,
    ChunkContent,
    ChunkHeader,
    message_at,
    parse_chunk,
    unpacked,
)
from likeme_bags.mcap_scan import ChunkPlace, walk
from likeme_bags.mcap_topics import McapTopics
from likeme_bags.prefetch import Ahead
from likeme_bags.storage import BlockCache, Channel


class McapStorage:
    """One MCAP file.

    thorough: decompress every chunk at once, rather than believe the message index until a chunk
    is read. It happens anyway when the file is not in order. salvage: also the messages of a last
    chunk that was cut, for which no checksum vouches.
    """

    def __init__(
        self, path: Path, notes: Notes, thorough: bool = False, salvage: bool = False
    ) -> None:
        self.index = Index()
        self.channels: dict[int, Channel] = {}
        self._notes = notes
        self._file = FileBytes(path)
        self._cache: BlockCache[ChunkContent] = BlockCache()
        self._ahead: Ahead[ChunkContent] = Ahead(self._read, self._size_of)
        self._checked: set[int] = set()
        self._unreadable: set[int] = set()
        # The number of a last chunk that was cut.
        self._cut = -1
        try:
            self._layout = walk(self._file, notes, salvage)
            self._topics = McapTopics(self._file.name, self._layout, notes)
            self._index_chunks(thorough or not notes.complete)
            self._index_loose()
            if self._layout.cut is not None:
                self._index_cut(self._layout.cut, salvage)
            vouched = salvage or notes.complete or self._layout.summary_checked
            self.channels = self._topics.channels(vouched or not self._layout.chunks)
            self._count()
        except BaseException:
            self.close()
            raise

    @property
    def checksums(self) -> bool:
        """Whether checksums cover every message, so that a flipped bit is noticed."""
        return not self._layout.loose and all(c.header.crc for c in self._layout.chunks)

    def close(self) -> None:
        """Let go of the file."""
        self._ahead.close()
        self._file.close()

    def fetch(self, stamp: int, channel: int, block: int, offset: int) -> bytes | None:
        """The message at a place; None, with a note, when another one is there."""
        try:
            if block < 0:
                found = self._loose_at(offset)
            else:
                content = self._content(block)
                if content is None:
                    return None
                found = message_at(content.data, offset)
        except DamagedError as error:
            self._lose(str(error))
            return None
        if found[:2] != (stamp, channel):
            self._lose(f'a message at {offset} differs from its entry in the index')
            return None
        return bytes(found[2])

    def _lose(self, why: str) -> None:
        self._notes.lost(self._file.name, why)

    def _index_chunks(self, thorough: bool) -> None:
        confirmed: set[int] = set()
        for number, chunk in enumerate(self._layout.chunks):
            listed = set(chunk.listed[1::3])
            trusted = chunk.agrees and not thorough
            if not trusted or listed - confirmed:
                # The first chunk with a channel tells, under its checksum, what the channel is.
                content = self._content(number)
                if content is None:
                    continue
                confirmed |= listed
                if not trusted:
                    self._index_content(number, content)
                    continue
            entries = chunk.listed
            self.index.extend(zip(entries[::3], entries[1::3], entries[2::3], strict=True), number)

    def _index_content(self, number: int, content: ChunkContent) -> None:
        """Index a chunk by what is in it."""
        found = content.messages
        for stamp, channel, offset in zip(found[::3], found[1::3], found[2::3], strict=True):
            if stamp > MAX_STAMP:
                self._lose(f'log time {stamp} ns is past the year 2262')
            else:
                self.index.add(stamp, channel, number, offset)

    def _content(self, number: int) -> ChunkContent | None:
        """A chunk, decompressed and checked; None, with a note, when it cannot be read."""
        if number < 0 or number in self._unreadable:
            return None
        content = self._cache.get(number)
        if content is None:
            try:
                content = self._ahead.get(number)
            except DamagedError as error:
                self._unreadable.add(number)
                self._lose(f'chunk {number} cannot be read: {error}')
                return None
            self._cache.put(number, content, len(content.data) + 8 * len(content.messages))
            if number not in self._checked:
                self._checked.add(number)
                self._check(number, content)
        return content

    def _size_of(self, number: int) -> int:
        """What a chunk says it unpacks to; 0 where there is none."""
        chunks = self._layout.chunks
        return chunks[number].header.size if number < len(chunks) else 0

    def _read(self, number: int) -> ChunkContent:
        """A chunk, decompressed; called by other threads, too."""
        header = self._layout.chunks[number].header
        if max(header.stored, header.size) > MAX_BLOCK:
            size = max(header.stored, header.size)
            raise DamagedError(f'Expected at most {MAX_BLOCK} bytes in a chunk, got {size}.')
        if number == self._cut:
            # It ends in the middle of something, which has been said already.
            return self._read_cut(header)._replace(trouble='')
        return parse_chunk(unpacked(header, self._file.read(header.at, header.stored)))

    def _check(self, number: int, content: ChunkContent) -> None:
        """Compare a chunk, the first time it is read, with what was said of it elsewhere."""
        if content.trouble:
            self._lose(f'chunk {number} is damaged inside: {content.trouble}')
        chunk = self._layout.chunks[number]
        in_it, listed = len(content.messages) // 3, len(chunk.listed) // 3
        if chunk.agrees and in_it != listed:
            self._notes.loss(
                About.CHUNKS,
                f'{self._file.name}: chunk {number} holds {in_it} messages, its index {listed}.',
            )
        self._topics.learn(content)

    def _index_cut(self, header: ChunkHeader, salvage: bool) -> None:
        have = max(min(header.stored, self._file.size - header.at), 0)
        if not salvage:
            self._lose(f'the last chunk was cut off after {have} of {header.stored} bytes')
            return
        self._cut = len(self._layout.chunks)
        self._layout.chunks.append(ChunkPlace(header))
        content = self._content(self._cut)
        if content is not None:
            self._index_content(self._cut, content)

    def _read_cut(self, header: ChunkHeader) -> ChunkContent:
        stored = self._file.read(header.at, min(header.stored, MAX_BLOCK))
        return parse_chunk(decompress_prefix(stored, header.method, header.size))

    def _index_loose(self) -> None:
        loose = self._layout.loose
        if loose and self._layout.chunks:
            self._lose(f'{len(loose)} lie outside the chunks of a file of chunks')
            return
        for at in loose:
            stamp, channel, _ = self._loose_at(at)
            if stamp > MAX_STAMP:
                self._lose(f'log time {stamp} ns is past the year 2262')
            else:
                self.index.add(stamp, channel, -1, at)

    def _loose_at(self, at: int) -> tuple[int, int, memoryview]:
        prefix = self._file.read(at, PREFIX.size)
        length = PREFIX.unpack(prefix)[1]
        if length > MAX_BLOCK:
            raise DamagedError(f'Expected at most {MAX_BLOCK} bytes in a message, got {length}.')
        return message_at(prefix + self._file.read(at + PREFIX.size, length), 0)

    def _count(self) -> None:
        promised, found = self._layout.message_count, len(self.index)
        if promised is None or promised == found:
            return
        tell = self._notes.loss if found < promised else self._notes.remark
        tell(
            About.CHUNKS,
            f'{self._file.name}: {found} messages found, its statistics say {promised}.',
        )
