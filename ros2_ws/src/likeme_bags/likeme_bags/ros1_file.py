"""Finding one's way in a ROS 1 bag: records by offset, and the next chunk behind damage."""

from __future__ import annotations

from likeme_bags.byte_reader import Cursor
from likeme_bags.errors import DamagedError
from likeme_bags.files import FileBytes
from likeme_bags.limits import MAX_CHUNKS
from likeme_bags.ros1_format import MAGIC, MAX_HEADER, Fields, Op, fields_of, u8, u64


def head_at(file: FileBytes, at: int) -> tuple[Fields, int, int]:
    """Header fields of the record at an offset, and where its data lies."""
    size = int.from_bytes(file.read(at, 4), 'little')
    if size > MAX_HEADER:
        raise DamagedError(f'Expected a record header of at most {MAX_HEADER} bytes, got {size}.')
    head = Cursor(file.read(at + 4, size + 4))
    fields = fields_of(head.take(size))
    return fields, at + 8 + size, head.u32()


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
                if u8(fields, 'op') == Op.CHUNK and body + size <= file.size:
                    return at
            except DamagedError:
                continue
    return None


def _listed_chunks(file: FileBytes) -> list[int]:
    """File offsets of chunks by the chunk info records; [] when they cannot be read."""
    offsets: list[int] = []
    try:
        at = u64(head_at(file, len(MAGIC))[0], 'index_pos')
        while len(MAGIC) < at < file.size and len(offsets) < MAX_CHUNKS:
            fields, body, size = head_at(file, at)
            if u8(fields, 'op') == Op.CHUNK_INFO:
                offsets.append(u64(fields, 'chunk_pos'))
            at = body + size
    except DamagedError:
        pass
    return sorted(offsets)
