"""Reading an MCAP file through rosbags, which is given an index that holds and checked chunks.

The library's own way to the index trusts it without a checksum, drops type hashes, and refuses
the file for one schema in another language or one QoS profile that does not parse.
"""

from __future__ import annotations

from array import array
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from itertools import accumulate
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2.storage_mcap import ChunkInfo, McapReader
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from likeme_bags.bag_warnings import BagWarnings, Subject
from likeme_bags.byte_reader import ByteReader
from likeme_bags.errors import DamagedError
from likeme_bags.file_bytes import FileBytes
from likeme_bags.limits import MAX_MESSAGES, MAX_OPEN
from likeme_bags.mcap_chunks import ChunkFile
from likeme_bags.mcap_format import (
    MESSAGE,
    PREFIX,
    ChannelRecord,
    ChunkHead,
    McapOp,
    Schema,
    channel_of,
    records_in,
    schema_of,
)
from likeme_bags.mcap_scan import scan
from likeme_bags.sorted_copy import sorted_copy
from likeme_bags.storage import MAX_STAMP, Attachment, Channel, Storage

# What of an attachment is read for its name, bytes.
_ATTACHMENT_HEAD = 2**12


class McapStorage(Storage):
    """One MCAP file.

    thorough: index every chunk by its content at once, rather than by its message indexes.
    to_repair: also take the messages of a last chunk that was cut, for which no checksum vouches.
    """

    def __init__(
        self, path: Path, log: BagWarnings, thorough: bool = False, to_repair: bool = False
    ) -> None:
        super().__init__(path, log, to_repair)
        self._library = McapReader(path)
        self._schemas: dict[int, Schema] = {}
        self._records: dict[int, ChannelRecord] = {}
        # Log times by channel, once the chunks were indexed by their content.
        self._stamps: dict[int, array[int]] = {}
        self._copy: Sqlite3Reader | None = None
        self._file = FileBytes(path)
        self._opened.callback(self._file.close)
        try:
            self._scan = scan(self._file, log, to_repair)
            for place in self._scan.attachments:
                self._attach(*place)
            if thorough or not self._can_use_indexes():
                self._salvaged = True
                self._index_content()
        except BaseException:
            self.release()
            raise

    @property
    def channels(self) -> Mapping[int, Channel]:
        """All topics by id."""
        return {key: self._channel(record) for key, record in self._records.items()}

    @property
    def counts(self) -> Mapping[int, int]:
        """Messages by id of their channel."""
        counts: dict[int, int] = defaultdict(int)
        for chunk in self._library.chunks:
            for key, count in chunk.channel_count.items():
                counts[key] += count
        return counts

    @property
    def span(self) -> tuple[int, int]:
        """Log times of the first and the last message, ns."""
        chunks = [chunk for chunk in self._library.chunks if chunk.channel_count]
        begin = min(chunk.message_start_time for chunk in chunks)
        return begin, max(chunk.message_end_time for chunk in chunks)

    @property
    def checksums(self) -> bool:
        """Whether checksums cover every message, so that a flipped bit is noticed."""
        return all(head.crc for head in self._chunk_file.heads)

    def messages(
        self, connections: Collection[Connection], start: int | None, stop: int | None
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Messages in the order of log times; chunks that overlap too far are sorted on disk."""
        if self._copy is None and _most_at_once(self._library.chunks) > MAX_OPEN:
            self._copy = sorted_copy(self.connections, self._by_chunks(), self._opened)
        if self._copy:
            return self._copy.messages(connections, start, stop)
        if not self._library.chunks:
            # The library would scan the file.
            return iter(())
        # Without a start and a stop the library leaves out what a chunk's head does not cover.
        return self._library.messages(
            connections, start or 0, MAX_STAMP + 1 if stop is None else stop
        )

    def stamps(self, channel: int) -> NDArray[np.int64]:
        """Log times of a channel's messages, ns, rising; shape (n,)."""
        if self._salvaged:
            return np.sort(np.array(self._stamps.get(channel, ()), np.int64))
        entries = [
            self._file.read(at, 16 * count)
            for head in self._scan.chunks
            for key, count, at in head.indexes
            if key == channel
        ]
        return np.sort(np.frombuffer(b''.join(entries), '<u8')[::2].astype(np.int64))

    def _by_chunks(self) -> Iterator[tuple[Connection, int, bytes]]:
        """All messages, one chunk after the other."""
        library = McapReader(self._path)
        library.bio = self._library.bio
        for chunk in self._library.chunks:
            library.chunks = [chunk]
            yield from library.messages(self.connections)

    def _attach(self, op: int, at: int, size: int) -> None:
        """Keep an attachment or a metadata record, not rosbag2's own copy of metadata.yaml."""
        head = ByteReader(self._file.read(at, min(size, _ATTACHMENT_HEAD)))
        try:
            head.take(PREFIX.size + (16 if op == McapOp.ATTACHMENT else 0))
            name = head.text()
        except DamagedError as error:
            self._log.remark(Subject.CHUNKS, f'{self.name}: an attachment is damaged: {error}')
            return
        kind = 'attachment' if op == McapOp.ATTACHMENT else 'metadata record'
        if (op, name) != (McapOp.METADATA, 'rosbag2'):
            self.attachments.append(Attachment(kind, name, self._file, at, size))

    def _channel(self, record: ChannelRecord) -> Channel:
        schema = self._schemas.get(record.schema, Schema('', '', ''))
        return Channel(
            record.topic,
            schema.name,
            record.encoding,
            record.metadata.get('offered_qos_profiles', ''),
            schema.text,
            schema.encoding if schema.text else '',
            record.metadata.get('topic_type_hash', ''),
        )

    def _can_use_indexes(self) -> bool:
        """Index chunks by the message indexes behind them, if nothing speaks against these."""
        found, heads = self._scan, self._scan.chunks
        counts = [head.messages for head in heads]
        if not found.whole or not found.closed or found.runs or found.message_count != sum(counts):
            return False
        if any(head.end > MAX_STAMP or head.size < PREFIX.size for head in heads):
            return False
        self._chunk_file = ChunkFile(self._file, heads, self._lose)
        self._chunk_file.counts = counts
        seen: set[int] = set()
        chunks = []
        for number, head in enumerate(heads):
            channels: dict[int, int] = defaultdict(int)
            for channel, count, _ in head.indexes:
                channels[channel] += count
            if channels.keys() - seen:
                # The first chunk with a channel tells, under its checksum, what the channel is.
                seen |= channels.keys()
                content = self._chunk_file.content(number)
                if content is None:
                    return False
                for op, begin, end in records_in(content):
                    self._learn(op, memoryview(content)[begin:end])
            chunks.append(_info(head, head.start, head.end, head.size, channels))
        self._use(chunks)
        return True

    def _index_content(self) -> None:
        """Index every chunk by what is in it, up to its first damaged record."""
        found, heads = self._scan, list(self._scan.chunks or self._scan.runs)
        if found.chunks and found.runs:
            self._lose('messages lie outside the chunks of a file of chunks')
        if found.cut is not None and not self._to_repair:
            have = self._file.size - found.cut.at
            self._lose(f'the last chunk was cut off after {have} of {found.cut.stored} bytes')
        elif found.cut is not None:
            heads.append(found.cut)
        self._chunk_file = ChunkFile(self._file, heads, self._lose)
        self._chunk_file.cut = len(found.chunks) if found.cut is not None else -1
        self._use([self._indexed(number, head) for number, head in enumerate(heads)])
        total, promised = sum(self.counts.values()), found.message_count
        if promised is not None and promised != total:
            tell = self._log.loss if total < promised else self._log.remark
            sentence = f'{self.name}: {total} messages found, its statistics say {promised}.'
            tell(Subject.CHUNKS, sentence)

    def _indexed(self, number: int, head: ChunkHead) -> ChunkInfo:
        """What is in a chunk."""
        content = self._chunk_file.content(number) or b''
        counts: dict[int, int] = defaultdict(int)
        begin, end, whole = MAX_STAMP, 0, 0
        try:
            for op, first, last in records_in(content):
                if op == McapOp.MESSAGE:
                    if last - first < MESSAGE.size:
                        raise DamagedError(f'Expected a message, got {last - first} bytes.')
                    channel, _, stamp, _ = MESSAGE.unpack_from(content, first)
                    if stamp > MAX_STAMP:
                        self._lose(f'log time {stamp} ns is past the year 2262')
                    else:
                        counts[channel] += 1
                        begin, end = min(begin, stamp), max(end, stamp)
                        self._stamps.setdefault(channel, array('q')).append(stamp)
                self._learn(op, memoryview(content)[first:last])
                whole = last
        except DamagedError as error:
            if number != self._chunk_file.cut:
                self._lose(f'chunk {number} is damaged inside: {error}')
        if sum(map(len, self._stamps.values())) > MAX_MESSAGES:
            raise DamagedError(f'Expected at most {MAX_MESSAGES} messages in a file.')
        self._chunk_file.whole[number] = whole
        return _info(head, begin, end, whole, counts)

    def _use(self, chunks: list[ChunkInfo]) -> None:
        """Have the library read these chunks from now on."""
        self._take_vouched_definitions()
        self._opened.callback(self._chunk_file.close)
        self._library = McapReader(self._path)
        self._library.bio = cast(BinaryIO, self._chunk_file)
        self._library.chunks = chunks

    def _learn(self, op: int, body: bytes | memoryview) -> None:
        """Keep what a record says of a topic or a type, unless that is known."""
        known: dict[int, Any] = self._schemas if op == McapOp.SCHEMA else self._records
        if op not in (McapOp.SCHEMA, McapOp.CHANNEL):
            return
        key, said = schema_of(body) if op == McapOp.SCHEMA else channel_of(body)
        if known.setdefault(key, said) != said:
            self._log.remark(
                Subject.CHUNKS,
                f'{self.name}: topic or type {key} is described twice and differently; '
                'what stands with the messages counts.',
            )

    def _take_vouched_definitions(self) -> None:
        """Take what no chunk describes from outside the chunks, if something vouches for it."""
        found = self._scan
        unharmed = self._log.complete and found.summary_checked is None
        vouched = self._to_repair or found.summary_checked or unharmed or not found.chunks
        known = {(McapOp.SCHEMA, key) for key in self._schemas}
        known |= {(McapOp.CHANNEL, key) for key in self._records}
        for op, body in found.definitions:
            if vouched or (op, int.from_bytes(body[:2], 'little')) in known:
                self._learn(op, body)
            elif op == McapOp.CHANNEL:
                self._log.remark(
                    Subject.CHUNKS,
                    f'{self.name} is damaged, and nothing vouches for what it says of topic '
                    f'{channel_of(body)[1].topic}.',
                )


def _info(
    head: ChunkHead, begin: int, end: int, size: int, counts: Mapping[int, int]
) -> ChunkInfo:
    """A chunk as the library reads it from a `ChunkFile`: uncompressed."""
    return ChunkInfo(begin, end, head.offset, 0, {}, 0, '', size, size, dict(counts))


def _most_at_once(chunks: list[ChunkInfo]) -> int:
    """Bytes of the chunks that the library holds at the same time, at most."""
    begins = [(c.message_start_time, 0, c.uncompressed_size) for c in chunks]
    ends = [(c.message_end_time, 1, -c.uncompressed_size) for c in chunks]
    sizes = accumulate(size for _, _, size in sorted(begins + ends))
    return max(sizes, default=0)
