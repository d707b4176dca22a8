"""The records of a ROS 1 bag (wiki.ros.org/Bags/Format/2.0): fields name=value, then data."""

from __future__ import annotations

from enum import IntEnum

from likeme_bags.byte_reader import ByteReader
from likeme_bags.errors import DamagedError
from likeme_bags.file_bytes import FileBytes

MAGIC = b'#ROSBAG V2.0\n'
# A record's header, which holds a handful of short fields, bytes.
MAX_HEADER = 2**16

Fields = dict[str, bytes]


class Ros1Op(IntEnum):
    """Kinds of records."""

    MESSAGE = 2
    BAG = 3
    INDEX = 4
    CHUNK = 5
    CHUNK_INFO = 6
    CONNECTION = 7


def fields_of(header: memoryview) -> Fields:
    """The name=value fields of a header, each after its length."""
    reader, fields = ByteReader(header), Fields()
    while reader.left:
        name, equals, value = bytes(reader.block()).partition(b'=')
        if not equals:
            raise DamagedError(f'Expected a field name=value, got {name[:20]!r}.')
        fields[name.decode('ascii', 'replace')] = value
    return fields


def number(fields: Fields, name: str, size: int) -> int:
    """A field of `size` bytes."""
    value = fields.get(name, b'')
    if len(value) != size:
        raise DamagedError(f'Expected a field {name} of {size} bytes, got {len(value)}.')
    return int.from_bytes(value, 'little')


def time_of(fields: Fields) -> int:
    """The field `time`, ns."""
    nanoseconds, seconds = divmod(number(fields, 'time', 8), 2**32)
    return seconds * 10**9 + nanoseconds


def head_at(file: FileBytes, at: int) -> tuple[Fields, int, int]:
    """Header fields of the record at an offset, and where its data lies and how long it is."""
    size = int.from_bytes(file.read(at, 4), 'little')
    if size > MAX_HEADER:
        raise DamagedError(f'Expected a record header of at most {MAX_HEADER} bytes, got {size}.')
    head = ByteReader(file.read(at + 4, size + 4))
    fields = fields_of(head.take(size))
    return fields, at + 8 + size, head.number(4)
