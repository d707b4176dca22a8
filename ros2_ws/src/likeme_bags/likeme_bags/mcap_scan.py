"""The layout of an MCAP file: its records from front to back, whatever its index claims."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

from likeme_bags.bag_warnings import About, Notes
from likeme_bags.byte_reader import Cursor
from likeme_bags.errors import DamagedError
from likeme_bags.files import FileBytes
from likeme_bags.index import MAX_STAMP
from likeme_bags.limits import MAX_CHUNKS
from likeme_bags.mcap_format import (
    MAGIC,
    MESSAGE,
    PREFIX,
    ChannelRecord,
    ChunkHeader,
    Op,
    Schema,
    channel_of,
    schema_of,
)
from likeme_bags.mcap_summary import (
    head_of_chunk,
    listed_chunks,
    next_chunk,
    record_prefix,
    summary_holds,
)


@dataclass
class ChunkPlace:
    """A chunk, and what the message index records behind it say of its messages."""

    header: ChunkHeader
    # (log time, channel, offset) one after another.
    listed: array[int] = field(default_factory=lambda: array('Q'))

    @property
    def agrees(self) -> bool:
        """Whether the index and the chunk's own times say the same, and all of it can be."""
        stamps, offsets = self.listed[::3], self.listed[2::3]
        if not stamps or max(stamps) > MAX_STAMP or max(offsets) >= self.header.size:
            return False
        # An offset that is listed twice would give its message twice.
        if len(set(offsets)) < len(offsets):
            return False
        return (min(stamps), max(stamps)) == self.header[:2]


@dataclass
class Layout:
    """What a walk over the file found."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, ChannelRecord] = field(default_factory=dict)
    chunks: list[ChunkPlace] = field(default_factory=list)
    # Times, size, checksum and method of the chunks: none comes twice.
    marks: set[tuple[int | str, ...]] = field(default_factory=set)
    # File offsets of messages outside chunks.
    loose: array[int] = field(default_factory=lambda: array('Q'))
    # The head of a last chunk that is not all there.
    cut: ChunkHeader | None = None
    # File offsets of chunks by the index at the end, and the number of messages it gives.
    chunk_offsets: list[int] = field(default_factory=list)
    message_count: int | None = None
    # A checksum over the summary at the end is there and holds.
    summary_checked: bool = False
    # The file was finished by its writer: footer and magic are there.
    closed: bool = False


def walk(file: FileBytes, notes: Notes, salvage: bool = False) -> Layout:
    """Walk over all records; gaps that no record explains are noted and stepped over.

    salvage: a file that ends too early is what one came to mend, and no loss of what it holds.
    """
    if file.read(0, 8) != MAGIC:
        raise DamagedError(f'Expected an MCAP file, got one that begins with {file.read(0, 8)!r}.')
    layout = Layout(chunk_offsets=listed_chunks(file), summary_checked=summary_holds(file))
    at, seen = 8, set()
    while at < file.size and not layout.closed:
        try:
            op, body, length = record_prefix(file, at)
            if op == Op.CHUNK:
                seen.add(at)
            _take(layout, file, op, body, length)
            at = body + length
        except DamagedError as error:
            onward = next_chunk(file, layout.chunk_offsets, at)
            if onward is None:
                _note_end(file, at, str(error), notes, salvage)
                break
            notes.loss(About.INDEX, f'{file.name} is damaged from byte {at} to {onward}: {error}')
            at = onward
    if not layout.closed:
        tell = notes.remark if salvage else notes.loss
        tell(About.INDEX, f'{file.name} was not closed by its writer, or its end is missing.')
    if missed := sorted(set(layout.chunk_offsets) - seen):
        notes.loss(
            About.INDEX, f'{file.name}: its index lists {len(missed)} chunks that are not there.'
        )
    return layout


def _note_end(file: FileBytes, at: int, why: str, notes: Notes, salvage: bool) -> None:
    if _is_cut(file, at):
        tell = notes.remark if salvage else notes.loss
        tell(About.INDEX, f'{file.name} ends in the middle of a record that begins at byte {at}.')
    else:
        notes.loss(About.INDEX, f'{file.name} is damaged from byte {at} of {file.size} on: {why}')


def _is_cut(file: FileBytes, at: int) -> bool:
    """Whether a plausible record begins here and the file ends before it does."""
    prefix = file.read(at, PREFIX.size)
    if len(prefix) < PREFIX.size:
        return True
    op, length = PREFIX.unpack(prefix)
    return bool(0 < op <= Op.DATA_END and at + PREFIX.size + length > file.size)


def _take(layout: Layout, file: FileBytes, op: int, body: int, length: int) -> None:
    """Note one record in the layout."""
    if op == Op.CHUNK:
        _take_chunk(layout, file, body, length)
        return
    if body + length > file.size:
        raise DamagedError(f'Expected a record of {length} bytes, got {file.size - body}.')
    if op == Op.MESSAGE:
        if length < MESSAGE.size:
            raise DamagedError(f'Expected a message of {MESSAGE.size} bytes, got {length}.')
        layout.loose.append(body - PREFIX.size)
    elif op == Op.MESSAGE_INDEX and layout.chunks:
        _list_messages(layout.chunks[-1], file.text(body, length))
    elif op == Op.SCHEMA:
        key, schema = schema_of(file.text(body, length))
        layout.schemas.setdefault(key, schema)
    elif op == Op.CHANNEL:
        key, channel = channel_of(file.text(body, length))
        layout.channels.setdefault(key, channel)
    elif op == Op.STATISTICS:
        layout.message_count = Cursor(file.text(body, length)).u64()
    elif op == Op.FOOTER:
        layout.closed = file.read(body + length, 8) == MAGIC


def _take_chunk(layout: Layout, file: FileBytes, body: int, length: int) -> None:
    header = head_of_chunk(file, body, length)
    if body + length > file.size:
        layout.cut = header
        raise DamagedError(f'Expected a chunk of {length} bytes, got {file.size - body}.')
    if len(layout.chunks) >= MAX_CHUNKS:
        raise DamagedError(f'Expected at most {MAX_CHUNKS} chunks, got more.')
    if header.crc and header[:5] in layout.marks:
        raise DamagedError('Expected every chunk once, got the same one again.')
    layout.marks.add(header[:5])
    layout.chunks.append(ChunkPlace(header))


def _list_messages(chunk: ChunkPlace, body: bytes) -> None:
    """Add what a message index record says."""
    fields = Cursor(body)
    channel = fields.u16()
    entries = memoryview(fields.block())
    if len(entries) % 16:
        raise DamagedError(f'Expected index entries of 16 bytes, got {len(entries)} bytes.')
    # The file is little-endian, as is every machine ROS 2 runs on.
    numbers = array('Q', bytes(entries))
    for stamp, offset in zip(numbers[::2], numbers[1::2], strict=True):
        chunk.listed.extend((stamp, channel, offset))
