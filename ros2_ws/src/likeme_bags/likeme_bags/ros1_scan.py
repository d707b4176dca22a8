"""All records of a ROS 1 bag from front to back, whatever its index claims; no chunk is read."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import NamedTuple

from likeme_bags.bag_warnings import BagWarnings, Subject
from likeme_bags.errors import DamagedError
from likeme_bags.file_bytes import FileBytes
from likeme_bags.limits import MAX_BLOCK, MAX_CHUNKS
from likeme_bags.ros1_format import MAGIC, MAX_HEADER, Fields, Ros1Op, head_at, number

# Seconds, nanoseconds and offset in the chunk.
_ENTRY = struct.Struct('<III')


class ChunkPlace(NamedTuple):
    """A chunk's data: where it lies in the file, and what is needed to read it."""

    # File offset of the chunk's record.
    offset: int
    at: int
    stored: int
    size: int
    method: str
    # Connection, number of entries, and file offset of the index records behind the chunk.
    indexes: list[tuple[int, int, int]]

    def listed(self, file: FileBytes) -> set[tuple[int, int, int]]:
        """(time in ns, connection, offset in the chunk) of all entries of the index records."""
        return {
            (seconds * 10**9 + nanoseconds, connection, offset)
            for connection, count, at in self.indexes
            for seconds, nanoseconds, offset in struct.iter_unpack(
                '<III', file.text(at, 12 * count)
            )
        }


@dataclass
class Ros1Scan:
    """What a bag holds."""

    chunks: list[ChunkPlace] = field(default_factory=list)
    # Raw records of connections outside chunks.
    connections: list[bytes] = field(default_factory=list)
    # The last chunk is not all there, and was asked for all the same.
    cut: bool = False
    # Chunks by the bag header.
    promised: int | None = None
    # Messages by the chunk infos at the end.
    message_count: int = 0
    # Every record was as it should be.
    whole: bool = True


def scan(file: FileBytes, log: BagWarnings, to_repair: bool = False) -> Ros1Scan:
    """Walk over all records; what no record explains is warned of and stepped over.

    to_repair: a bag that ends too early is what one came to mend, and no loss of what it holds.
    """
    if file.read(0, len(MAGIC)) != MAGIC:
        begin = file.read(0, len(MAGIC))
        raise DamagedError(
            f'Expected a ROS 1 bag of format 2.0, got one that begins with {begin!r}.'
        )
    found, at, end_is_loss = Ros1Scan(), len(MAGIC), log.remark if to_repair else log.loss
    while at < file.size:
        try:
            fields, body, size = head_at(file, at)
            if not _take(found, file, fields, (at, body, size), to_repair):
                found.whole = False
                end_is_loss(Subject.INDEX, f'{file.name} was not closed by its writer.')
            if body + size > file.size:
                raise DamagedError(f'Expected {size} bytes at {body}, got {file.size - body}.')
            at = body + size
        except DamagedError as error:
            found.whole = False
            onward = next_chunk(file, at)
            if onward is not None:
                log.loss(
                    Subject.INDEX, f'{file.name} is damaged from byte {at} to {onward}: {error}'
                )
                at = onward
                continue
            if is_cut(file, at):
                sentence = f'{file.name} ends in the middle of a record that begins at byte {at}.'
                end_is_loss(Subject.INDEX, sentence)
            else:
                sentence = f'{file.name} is damaged from byte {at} of {file.size} on: {error}'
                log.loss(Subject.INDEX, sentence)
            break
    _compare(found, file.name, log)
    return found


def _compare(found: Ros1Scan, name: str, log: BagWarnings) -> None:
    """Compare what was found with what the bag header promises."""
    if found.promised is None:
        log.loss(Subject.INDEX, f'{name}: its first record, the bag header, is missing.')
    elif found.promised > len(found.chunks):
        log.loss(
            Subject.INDEX,
            f'{name}: {len(found.chunks)} chunks found, its header says {found.promised}.',
        )
    found.whole &= found.promised == len(found.chunks)


def _take(
    found: Ros1Scan, file: FileBytes, fields: Fields, place: tuple[int, int, int], to_repair: bool
) -> bool:
    """Keep what one record says; False: it says that the bag was not closed."""
    at, body, size = place
    op = number(fields, 'op', 1)
    if op == Ros1Op.BAG:
        found.promised = number(fields, 'chunk_count', 4)
        return number(fields, 'index_pos', 8) > 0
    if op == Ros1Op.CHUNK:
        method = fields.get('compression', b'').decode('ascii', 'replace')
        if method not in ('none', 'bz2', 'lz4'):
            raise DamagedError(f'Expected compression none, bz2 or lz4, got {method!r}.')
        if len(found.chunks) >= MAX_CHUNKS:
            raise DamagedError(f'Expected at most {MAX_CHUNKS} chunks, got more.')
        cut = body + size > file.size
        if cut and not to_repair:
            raise DamagedError(f'Expected a chunk of {size} bytes, got {file.size - body}.')
        found.cut = cut
        stored = min(size, MAX_BLOCK, file.size - body)
        unpacked = number(fields, 'size', 4)
        found.chunks.append(ChunkPlace(at, body, stored, unpacked, method, []))
    elif op == Ros1Op.INDEX and found.chunks:
        count = number(fields, 'count', 4)
        if size != 12 * count:
            raise DamagedError(f'Expected {count} index entries of 12 bytes, got {size} bytes.')
        found.chunks[-1].indexes.append((number(fields, 'conn', 4), count, body))
    elif op == Ros1Op.CONNECTION:
        file.text(body, size)
        found.connections.append(file.text(at, body + size - at))
    elif op == Ros1Op.CHUNK_INFO:
        counts = struct.iter_unpack('<II', file.text(body, size // 8 * 8))
        found.message_count += sum(count for _, count in counts)
    else:
        raise DamagedError(f'Expected a record of a bag, got one of kind {op}.')
    return True


def is_cut(file: FileBytes, at: int) -> bool:
    """Whether a record begins here and the file ends before it does."""
    try:
        _, body, size = head_at(file, at)
    except DamagedError:
        return file.size - at < MAX_HEADER
    return body + size > file.size


def next_chunk(file: FileBytes, after: int) -> int | None:
    """Where the next chunk behind a damaged place begins, by the index at the end."""
    for at in _listed_chunks(file):
        if at > after:
            try:
                fields, body, size = head_at(file, at)
                if number(fields, 'op', 1) == Ros1Op.CHUNK and body + size <= file.size:
                    return at
            except DamagedError:
                continue
    return None


def _listed_chunks(file: FileBytes) -> list[int]:
    """File offsets of chunks by the chunk info records; [] when they cannot be read."""
    offsets: list[int] = []
    try:
        at = number(head_at(file, len(MAGIC))[0], 'index_pos', 8)
        while len(MAGIC) < at < file.size and len(offsets) < MAX_CHUNKS:
            fields, body, size = head_at(file, at)
            if number(fields, 'op', 1) == Ros1Op.CHUNK_INFO:
                offsets.append(number(fields, 'chunk_pos', 8))
            at = body + size
    except DamagedError:
        pass
    return sorted(offsets)
