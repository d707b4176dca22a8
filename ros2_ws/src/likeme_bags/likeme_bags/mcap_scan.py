"""All records of an MCAP file from front to back, whatever its index claims; no chunk is read."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from zlib import crc32

from likeme_bags.bag_warnings import BagWarnings, Subject
from likeme_bags.byte_reader import ByteReader
from likeme_bags.errors import DamagedError
from likeme_bags.file_bytes import FileBytes
from likeme_bags.limits import MAX_CHUNKS, MAX_TEXT
from likeme_bags.mcap_format import MAGIC, MESSAGE, PREFIX, ChunkHead, McapOp, chunk_head

# The longest head of a chunk: five numbers and the name of a compression.
_CHUNK_HEAD = 80
# Where a compressed chunk names its compression: what a search for the next chunk looks for.
_METHOD = re.compile(rb'\x04\0\0\0zstd|\x03\0\0\0lz4')
# Bytes of a chunk record before that name.
_BEFORE_METHOD = PREFIX.size + 28
# Messages outside chunks are taken together up to this many bytes.
_RUN = 4 * 2**20
# Bytes of a footer and the magic after it.
_FOOTER = PREFIX.size + 20 + len(MAGIC)


@dataclass
class McapScan:
    """What a file holds."""

    chunks: list[ChunkHead] = field(default_factory=list)
    # Messages outside chunks: each run of them as an uncompressed chunk without a checksum.
    runs: list[ChunkHead] = field(default_factory=list)
    # A last chunk that is not all there.
    cut: ChunkHead | None = None
    # (op code, body) of schemas and channels outside chunks.
    definitions: list[tuple[int, bytes]] = field(default_factory=list)
    # (op code, file offset, length) of attachments and metadata records.
    attachments: list[tuple[int, int, int]] = field(default_factory=list)
    # Messages by the statistics in the file.
    message_count: int | None = None
    # Footer and magic are there.
    closed: bool = False
    # Every record was as it should be.
    whole: bool = True
    # Whether the checksum of the summary at the end holds; None: it has none.
    summary_checked: bool | None = None
    # File offsets of chunks by the index, where reading can go on behind damage.
    listed: set[int] = field(default_factory=set)
    # Checksums of chunks with their times and sizes: none comes twice.
    marks: set[tuple[int | str, ...]] = field(default_factory=set)


def scan(file: FileBytes, log: BagWarnings, to_repair: bool = False) -> McapScan:
    """Walk over all records; what no record explains is warned of and stepped over.

    to_repair: a file that ends too early is what one came to mend, and no loss of what it holds.
    """
    if file.read(0, len(MAGIC)) != MAGIC:
        begin = file.read(0, len(MAGIC))
        raise DamagedError(f'Expected an MCAP file, got one that begins with {begin!r}.')
    found, at, end_is_loss = McapScan(), len(MAGIC), log.remark if to_repair else log.loss
    try:
        found.listed |= set(_listed_chunks(file, found))
    except DamagedError:
        found.listed.clear()
    if found.summary_checked is False:
        found.whole = False
        log.remark(Subject.INDEX, f'{file.name}: its index has another checksum than it says.')
    while at < file.size and not found.closed:
        try:
            op, length = _prefix(file, at)
            _take(found, file, op, at, length)
            at += PREFIX.size + length
        except DamagedError as error:
            found.whole = False
            if (onward := _next_chunk(file, found.listed, at)) is not None:
                sentence = f'{file.name} is damaged from byte {at} to {onward}: {error}'
                log.loss(Subject.INDEX, sentence)
                at = onward
                continue
            if _is_cut(file, at):
                sentence = f'{file.name} ends in the middle of a record that begins at byte {at}.'
                end_is_loss(Subject.INDEX, sentence)
            else:
                sentence = f'{file.name} is damaged from byte {at} of {file.size} on: {error}'
                log.loss(Subject.INDEX, sentence)
            break
    if not found.closed:
        sentence = f'{file.name} was not closed by its writer, or its end is missing.'
        end_is_loss(Subject.INDEX, sentence)
    if missing := found.listed - {chunk.offset for chunk in found.chunks}:
        sentence = f'{file.name}: its index lists {len(missing)} chunks that are not there.'
        log.loss(Subject.INDEX, sentence)
    return found


def _listed_chunks(file: FileBytes, found: McapScan) -> Iterator[int]:
    """File offsets of chunks by the summary at the end; checks the summary's checksum first."""
    end = max(file.size - _FOOTER, 0)
    footer = ByteReader(file.read(end, _FOOTER))
    if footer.take(PREFIX.size) != PREFIX.pack(McapOp.FOOTER, 20):
        raise DamagedError('Expected a footer, got something else.')
    at, _, expected = footer.number(8), footer.number(8), footer.number(4)
    crc, step = 0, 2**20
    for begin in range(at, end + 25 if at and expected else at, step):
        crc = crc32(file.read(begin, min(step, end + 25 - begin)), crc)
    found.summary_checked = crc == expected if expected else None
    while 0 < at < end:
        op, length = _prefix(file, at)
        if op == McapOp.CHUNK_INDEX:
            yield ByteReader(file.text(at + PREFIX.size, length), 16).number(8)
        at += PREFIX.size + length


def _prefix(file: FileBytes, at: int) -> tuple[int, int]:
    """Op code and length of the record at an offset."""
    prefix = file.read(at, PREFIX.size)
    if len(prefix) < PREFIX.size or not prefix[0]:
        raise DamagedError(f'Expected a record at {at}, got {prefix!r}.')
    op, length = PREFIX.unpack(prefix)
    return op, length


def _take(found: McapScan, file: FileBytes, op: int, at: int, length: int) -> None:
    """Keep what one record says."""
    body, size = at + PREFIX.size, PREFIX.size + length
    if op == McapOp.CHUNK:
        _take_chunk(found, file, at, length)
    elif length > file.size - body:
        raise DamagedError(f'Expected a record of {length} bytes, got {file.size - body}.')
    elif op == McapOp.MESSAGE:
        if length < MESSAGE.size:
            raise DamagedError(f'Expected a message of {MESSAGE.size} bytes, got {length}.')
        last = found.runs[-1] if found.runs else None
        if last and last.at + last.size == at and last.size + size <= _RUN:
            found.runs[-1] = last._replace(size=last.size + size, stored=last.size + size)
        else:
            found.runs.append(ChunkHead(at, 0, 0, size, 0, '', at, size, []))
    elif op == McapOp.MESSAGE_INDEX and found.chunks:
        head = ByteReader(file.read(body, 6))
        channel, entries = head.number(2), head.number(4)
        if entries + 6 != length or entries % 16:
            raise DamagedError(f'Expected index entries of 16 bytes, got {entries} bytes.')
        found.chunks[-1].indexes.append((channel, entries // 16, body + 6))
    elif op in (McapOp.SCHEMA, McapOp.CHANNEL):
        found.definitions.append((op, file.text(body, length)))
    elif op in (McapOp.ATTACHMENT, McapOp.METADATA):
        found.attachments.append((op, at, size))
    elif op == McapOp.STATISTICS:
        found.message_count = ByteReader(file.text(body, length)).number(8)
    elif op == McapOp.FOOTER:
        found.closed = file.read(body + length, len(MAGIC)) == MAGIC


def _take_chunk(found: McapScan, file: FileBytes, at: int, length: int) -> None:
    head = _head_at(file, at, length)
    if at + PREFIX.size + length > file.size:
        found.cut = head
        raise DamagedError(f'Expected a chunk of {length} bytes, got {file.size - at}.')
    mark = head[1:6]
    if head.crc and mark in found.marks:
        raise DamagedError('Expected every chunk once, got the same one again.')
    if len(found.chunks) >= MAX_CHUNKS:
        raise DamagedError(f'Expected at most {MAX_CHUNKS} chunks, got more.')
    found.marks.add(mark)
    found.chunks.append(head)


def _head_at(file: FileBytes, at: int, length: int) -> ChunkHead:
    return chunk_head(file.read(at + PREFIX.size, min(length, _CHUNK_HEAD)), at, length)


def _is_cut(file: FileBytes, at: int) -> bool:
    """Whether a plausible record begins here and the file ends before it does."""
    prefix = file.read(at, PREFIX.size)
    if len(prefix) < PREFIX.size:
        return True
    op, length = PREFIX.unpack(prefix)
    return bool(0 < op <= McapOp.DATA_END and at + PREFIX.size + length > file.size)


def _next_chunk(file: FileBytes, listed: set[int], after: int) -> int | None:
    """Where the next whole chunk behind a damaged place begins: by the index, else by search."""
    for offset in sorted(listed):
        if offset > after and _is_chunk(file, offset):
            return offset
    for at in range(after + 1, file.size, MAX_TEXT):
        window = file.read(at, MAX_TEXT + 64)
        for match in _METHOD.finditer(window):
            start = at + match.start() - _BEFORE_METHOD
            if start > after and _is_chunk(file, start):
                return start
    return None


def _is_chunk(file: FileBytes, at: int) -> bool:
    try:
        op, length = _prefix(file, at)
        _head_at(file, at, length)
    except DamagedError:
        return False
    return op == McapOp.CHUNK and at + PREFIX.size + length <= file.size
