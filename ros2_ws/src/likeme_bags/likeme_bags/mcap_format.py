"""The records of an MCAP file that matter here (mcap.dev/spec), as values."""

from __future__ import annotations

import struct
from array import array
from enum import IntEnum
from typing import NamedTuple
from zlib import crc32

from likeme_bags.byte_reader import Cursor
from likeme_bags.compression import decompress
from likeme_bags.errors import DamagedError
from likeme_bags.limits import MAX_IN_CHUNK

MAGIC = b'\x89MCAP0\r\n'
# Op code and length before every record.
PREFIX = struct.Struct('<BQ')
# Fields of a message before its data: channel, sequence, log time, publish time.
MESSAGE = struct.Struct('<HIQQ')


class Op(IntEnum):
    """Kinds of records."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    STATISTICS = 0x0B
    METADATA = 0x0C
    DATA_END = 0x0F


class Schema(NamedTuple):
    """A message type: name, language ('ros2msg', 'ros2idl') and text."""

    name: str
    encoding: str
    text: str


class ChannelRecord(NamedTuple):
    """A topic: the id of its schema, its name, how messages are encoded, and metadata."""

    schema: int
    topic: str
    encoding: str
    metadata: tuple[tuple[str, str], ...]


class ChunkHeader(NamedTuple):
    """What stands before the compressed records of a chunk; `at` is the file offset of those."""

    start: int
    end: int
    size: int
    crc: int
    method: str
    at: int
    stored: int


class ChunkContent(NamedTuple):
    """A decompressed and checked chunk."""

    data: bytes | memoryview
    schemas: dict[int, Schema]
    channels: dict[int, ChannelRecord]
    # (log time, channel, offset of the record) of every message, one after another.
    messages: array[int]
    # Why the rest could not be read, or ''.
    trouble: str


def schema_of(body: bytes | memoryview) -> tuple[int, Schema]:
    """Id and schema."""
    fields = Cursor(body)
    return fields.u16(), Schema(fields.text(), fields.text(), fields.text())


def channel_of(body: bytes | memoryview) -> tuple[int, ChannelRecord]:
    """Id and channel."""
    fields = Cursor(body)
    key, schema = fields.u16(), fields.u16()
    topic, encoding = fields.text(), fields.text()
    pairs = Cursor(fields.block())
    metadata = []
    while pairs.left:
        metadata.append((pairs.text(), pairs.text()))
    return key, ChannelRecord(schema, topic, encoding, tuple(metadata))


def chunk_header(head: bytes, body_at: int, length: int) -> ChunkHeader:
    """From the first bytes of a chunk record's body, which is `length` long and lies at `body_at`.

    Raises:
        DamagedError: the lengths in it do not add up.
    """
    fields = Cursor(head)
    start, end, size, crc = fields.u64(), fields.u64(), fields.u64(), fields.u32()
    method, stored = fields.text(), fields.u64()
    if fields.at + stored != length:
        raise DamagedError(f'Expected a chunk of {length} bytes, got {fields.at + stored}.')
    return ChunkHeader(start, end, size, crc, method, body_at + fields.at, stored)


def unpacked(header: ChunkHeader, stored: bytes) -> bytes | memoryview:
    """The records of a chunk, decompressed; its checksum, where there is one, holds."""
    data = decompress(stored, header.method, header.size)
    if header.crc and crc32(data) != header.crc:
        raise DamagedError(
            f'Expected a chunk with checksum {header.crc:08x}, got {crc32(data):08x}.'
        )
    return data


def parse_chunk(data: bytes | memoryview) -> ChunkContent:
    """Everything in a chunk's records up to the first that does not fit."""
    content = ChunkContent(data, {}, {}, array('Q'), '')
    at, end = 0, len(data)
    try:
        while at < end:
            if end - at < PREFIX.size:
                raise DamagedError(f'Expected a record at {at}, got {end - at} bytes.')
            op, length = PREFIX.unpack_from(data, at)
            body = at + PREFIX.size
            if length > end - body:
                raise DamagedError(f'Expected {length} bytes at {body}, got {end - body}.')
            if op == Op.MESSAGE:
                if length < MESSAGE.size:
                    raise DamagedError(
                        f'Expected a message of {MESSAGE.size} bytes, got {length}.'
                    )
                channel, _, stamp, _ = MESSAGE.unpack_from(data, body)
                content.messages.extend((stamp, channel, at))
                if len(content.messages) > 3 * MAX_IN_CHUNK:
                    raise DamagedError(f'Expected at most {MAX_IN_CHUNK} messages in a chunk.')
            elif op == Op.SCHEMA:
                key, schema = schema_of(memoryview(data)[body : body + length])
                content.schemas[key] = schema
            elif op == Op.CHANNEL:
                key, record = channel_of(memoryview(data)[body : body + length])
                content.channels[key] = record
            at = body + length
    except DamagedError as error:
        return content._replace(trouble=str(error))
    return content


def message_at(data: bytes | memoryview, offset: int) -> tuple[int, int, memoryview]:
    """Log time, channel and data of the message record at an offset.

    Raises:
        DamagedError: there is none.
    """
    fields = Cursor(data, offset)
    if not 0 <= offset <= len(data) or fields.u8() != Op.MESSAGE:
        raise DamagedError(f'Expected a message at {offset}, got something else.')
    body = fields.take(fields.u64())
    if len(body) < MESSAGE.size:
        raise DamagedError(f'Expected a message of {MESSAGE.size} bytes, got {len(body)}.')
    channel, _, stamp, _ = MESSAGE.unpack_from(body)
    return stamp, channel, body[MESSAGE.size :]
