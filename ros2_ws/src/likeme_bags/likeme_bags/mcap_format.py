"""The records of an MCAP file (mcap.dev/spec), as far as an index has to be made of them."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from enum import IntEnum
from typing import NamedTuple

from likeme_bags.byte_reader import ByteReader
from likeme_bags.errors import DamagedError

MAGIC = b'\x89MCAP0\r\n'
# Op code and length before every record.
PREFIX = struct.Struct('<BQ')
# Fields of a message before its data: channel, sequence, log time, publish time.
MESSAGE = struct.Struct('<HIQQ')


class McapOp(IntEnum):
    """Kinds of records."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    ATTACHMENT = 0x09
    STATISTICS = 0x0B
    METADATA = 0x0C
    DATA_END = 0x0F


class Schema(NamedTuple):
    """A message type: name, language and text."""

    name: str
    encoding: str
    text: str


class ChannelRecord(NamedTuple):
    """A topic: the id of its schema, its name, how messages are encoded, and metadata."""

    schema: int
    topic: str
    encoding: str
    metadata: dict[str, str]


class ChunkHead(NamedTuple):
    """A chunk without its records: `at` is the file offset of the `stored` compressed bytes."""

    # File offset of the chunk's record.
    offset: int
    start: int
    end: int
    size: int
    crc: int
    method: str
    at: int
    stored: int
    # Channel, number of entries and their file offset, of the message indexes behind it.
    indexes: list[tuple[int, int, int]]

    @property
    def messages(self) -> int:
        """Messages by the message indexes."""
        return sum(count for _, count, _ in self.indexes)


def records_in(data: bytes | memoryview) -> Iterator[tuple[int, int, int]]:
    """Op code, begin and end of the body of every record in a buffer.

    Raises:
        DamagedError: a record does not fit into what is left.
    """
    at, end = 0, len(data)
    while at < end:
        if end - at < PREFIX.size:
            raise DamagedError(f'Expected a record at {at}, got {end - at} bytes.')
        op, length = PREFIX.unpack_from(data, at)
        at += PREFIX.size
        if length > end - at:
            raise DamagedError(f'Expected {length} bytes at {at}, got {end - at}.')
        yield op, at, at + length
        at += length


def schema_of(body: bytes | memoryview) -> tuple[int, Schema]:
    """Id and schema."""
    fields = ByteReader(body)
    return fields.number(2), Schema(fields.text(), fields.text(), fields.text())


def channel_of(body: bytes | memoryview) -> tuple[int, ChannelRecord]:
    """Id and channel."""
    fields = ByteReader(body)
    key, schema = fields.number(2), fields.number(2)
    topic, encoding = fields.text(), fields.text()
    pairs, metadata = ByteReader(fields.block()), {}
    while pairs.left:
        name = pairs.text()
        metadata[name] = pairs.text()
    return key, ChannelRecord(schema, topic, encoding, metadata)


def chunk_head(head: bytes, offset: int, length: int) -> ChunkHead:
    """From the first bytes of the body of a chunk record at `offset`, which is `length` long.

    Raises:
        DamagedError: the lengths in it do not add up.
    """
    fields = ByteReader(head)
    start, end, size, crc = (fields.number(n) for n in (8, 8, 8, 4))
    method, stored = fields.text(), fields.number(8)
    if fields.at + stored != length:
        raise DamagedError(f'Expected a chunk of {length} bytes, got {fields.at + stored}.')
    return ChunkHead(
        offset, start, end, size, crc, method, offset + PREFIX.size + fields.at, stored, []
    )
