"""The records of a ROS 1 bag (wiki.ros.org/Bags/Format/2.0): fields name=value, then data."""

from __future__ import annotations

from enum import IntEnum

from likeme_bags.byte_reader import Cursor
from likeme_bags.errors import DamagedError

MAGIC = b'#ROSBAG V2.0\n'
# A record's header, which holds a handful of short fields, bytes.
MAX_HEADER = 2**16

Fields = dict[str, bytes]


class Op(IntEnum):
    """Kinds of records."""

    MESSAGE = 2
    BAG = 3
    INDEX = 4
    CHUNK = 5
    CHUNK_INFO = 6
    CONNECTION = 7


def record_at(cursor: Cursor) -> tuple[Fields, memoryview]:
    """Header fields and data of the record at a cursor."""
    return fields_of(cursor.block()), cursor.block()


def fields_of(header: memoryview) -> Fields:
    """The name=value fields of a header, each after its length."""
    cursor, fields = Cursor(header), Fields()
    while cursor.left:
        name, equals, value = bytes(cursor.block()).partition(b'=')
        if not equals:
            raise DamagedError(f'Expected a field name=value, got {name[:20]!r}.')
        fields[name.decode('ascii', 'replace')] = value
    return fields


def _number(fields: Fields, name: str, size: int) -> int:
    value = fields.get(name, b'')
    if len(value) != size:
        raise DamagedError(f'Expected a field {name} of {size} bytes, got {len(value)}.')
    return int.from_bytes(value, 'little')


def u8(fields: Fields, name: str) -> int:
    """A field of one byte."""
    return _number(fields, name, 1)


def u32(fields: Fields, name: str) -> int:
    """A field of four bytes."""
    return _number(fields, name, 4)


def u64(fields: Fields, name: str) -> int:
    """A field of eight bytes."""
    return _number(fields, name, 8)


def time_of(fields: Fields) -> int:
    """The field `time`, ns."""
    seconds, nanoseconds = divmod(u64(fields, 'time'), 2**32)[::-1]
    return seconds * 10**9 + nanoseconds


def text_of(fields: Fields, name: str) -> str:
    """A field of text."""
    if name not in fields:
        raise DamagedError(f'Expected a field {name}, got {sorted(fields)}.')
    try:
        return fields[name].decode('utf-8')
    except UnicodeDecodeError:
        raise DamagedError(f'Expected text in the field {name}, got other bytes.') from None
