"""Finding one's way in an MCAP file: its summary at the end, and the next chunk behind damage."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from zlib import crc32

from likeme_bags.byte_reader import Cursor
from likeme_bags.errors import DamagedError
from likeme_bags.files import FileBytes
from likeme_bags.limits import MAX_CHUNKS, MAX_TEXT
from likeme_bags.mcap_format import PREFIX, ChunkHeader, Op, chunk_header

# Read at once while a checksum is formed, bytes.
_STEP = 2**20
# The longest head of a chunk: five numbers and the name of a compression.
_CHUNK_HEAD = 80
# Where a compressed chunk names its compression: what a search for the next chunk looks for.
_METHOD = re.compile(rb'\x04\0\0\0zstd|\x03\0\0\0lz4')
# Bytes of a chunk record before that name.
_BEFORE_METHOD = PREFIX.size + 28


def record_prefix(file: FileBytes, at: int) -> tuple[int, int, int]:
    """Op code, body's offset and length of the record at an offset."""
    prefix = file.read(at, PREFIX.size)
    if len(prefix) < PREFIX.size:
        raise DamagedError(f'Expected a record at {at}, got {len(prefix)} bytes.')
    op, length = PREFIX.unpack(prefix)
    if op == 0:
        raise DamagedError(f'Expected a record at {at}, got a zero.')
    return op, at + PREFIX.size, length


def head_of_chunk(file: FileBytes, body: int, length: int) -> ChunkHeader:
    """What stands before a chunk's records."""
    return chunk_header(file.read(body, min(length, _CHUNK_HEAD)), body, length)


def listed_chunks(file: FileBytes) -> list[int]:
    """File offsets of chunks by the summary at the end; [] when that cannot be read."""
    try:
        return list(_summary_chunks(file))[:MAX_CHUNKS]
    except DamagedError:
        return []


def _summary_chunks(file: FileBytes) -> Iterator[int]:
    footer = Cursor(file.read(max(file.size - 37, 0), 37))
    prefix = bytes(footer.take(PREFIX.size))
    if prefix != PREFIX.pack(Op.FOOTER, 20):
        raise DamagedError(f'Expected a footer, got {prefix!r}.')
    at = footer.u64()
    while 0 < at < file.size:
        op, body, length = record_prefix(file, at)
        if op == Op.FOOTER:
            return
        if body + length > file.size:
            raise DamagedError(f'Expected a record of {length} bytes, got {file.size - body}.')
        if op == Op.CHUNK_INDEX:
            yield Cursor(file.text(body, length), 16).u64()
        at = body + length


def summary_holds(file: FileBytes) -> bool:
    """Whether the summary has a checksum (many writers leave it 0), and it is the right one."""
    footer = file.read(file.size - 37, 29)
    if footer[:9] != PREFIX.pack(Op.FOOTER, 20):
        return False
    begin, end = int.from_bytes(footer[9:17], 'little'), file.size - 12
    expected = int.from_bytes(footer[25:29], 'little')
    if not (expected and 0 < begin < end):
        return False
    crc = 0
    for at in range(begin, end, _STEP):
        crc = crc32(file.read(at, min(_STEP, end - at)), crc)
    return crc == expected


def next_chunk(file: FileBytes, listed: Sequence[int], after: int) -> int | None:
    """Where the next whole chunk behind a damaged place begins: by the index, else by search."""
    candidates = [offset for offset in listed if offset > after]
    found = next((o for o in sorted(candidates) if _is_chunk(file, o)), None)
    return found if found is not None else _search_chunk(file, after + 1)


def _is_chunk(file: FileBytes, at: int) -> bool:
    try:
        op, body, length = record_prefix(file, at)
        head_of_chunk(file, body, length)
    except DamagedError:
        return False
    return op == Op.CHUNK and body + length <= file.size


def _search_chunk(file: FileBytes, begin: int) -> int | None:
    """The first place from `begin` on where a compressed chunk's lengths add up."""
    at, step = begin, MAX_TEXT
    while at < file.size:
        window = file.read(at, step + 64)
        for match in _METHOD.finditer(window):
            start = at + match.start() - _BEFORE_METHOD
            if start >= begin and _is_chunk(file, start):
                return start
        at += step
    return None
