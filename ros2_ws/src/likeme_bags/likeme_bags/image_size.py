"""How large a PNG, JPEG or TIFF claims to be, read before anything is allocated for it."""

from __future__ import annotations

from typing import Literal

from likeme_bags.byte_reader import ByteReader
from likeme_bags.errors import DamagedError

_PNG, _JPEG = b'\x89PNG\r\n\x1a\n', b'\xff\xd8'
_TIFF: dict[bytes, Literal['little', 'big']] = {b'II*\0': 'little', b'MM\0*': 'big'}
# Where the size of a JPEG must stand, bytes: a bound on the markers to look at.
_JPEG_HEAD = 2**16
# Tags of TIFF.
_WIDTH, _HEIGHT = 256, 257
# Start-of-frame markers of JPEG; C4, C8 and CC are other things.
_FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}
# Markers without a length behind them.
_BARE = {0x01, *range(0xD0, 0xD9)}


def is_still_image(data: bytes) -> bool:
    """Whether something begins as a PNG, JPEG or TIFF."""
    return data.startswith((_PNG[:4], _JPEG, *_TIFF))


def claimed_size(data: memoryview) -> tuple[int, int]:
    """Height and width, pixels.

    Raises:
        DamagedError: none of the three, or cut before the size.
    """
    begin = bytes(data[:24])
    if begin.startswith(_PNG) and len(begin) == 24:
        return int.from_bytes(begin[20:24], 'big'), int.from_bytes(begin[16:20], 'big')
    if begin.startswith(_JPEG):
        return _jpeg_size(ByteReader(data[:_JPEG_HEAD], 2))
    if begin[:4] in _TIFF:
        return _tiff_size(data, _TIFF[begin[:4]])
    raise DamagedError(
        f'Expected a PNG, JPEG or TIFF image, got bytes that begin with {begin[:8]!r}.'
    )


def _jpeg_size(cursor: ByteReader) -> tuple[int, int]:
    while True:
        if (byte := cursor.number(1)) != 0xFF:
            raise DamagedError(f'Expected a JPEG marker at {cursor.at - 1}, got 0x{byte:02x}.')
        marker = cursor.number(1)
        while marker == 0xFF:
            marker = cursor.number(1)
        if marker in _BARE:
            continue
        length = _big16(cursor)
        if marker in _FRAMES:
            cursor.number(1)
            return _big16(cursor), _big16(cursor)
        cursor.take(max(length - 2, 0))


def _tiff_size(data: memoryview, order: Literal['little', 'big']) -> tuple[int, int]:
    """From the first directory, whose entries are tag, type, count and value: 2, 2, 4, 4 bytes."""
    at = int.from_bytes(data[4:8], order)
    count = int.from_bytes(data[at : at + 2], order)
    sizes = {}
    for entry in range(at + 2, min(at + 2 + 12 * count, len(data) - 11), 12):
        tag, kind = (int.from_bytes(data[i : i + 2], order) for i in (entry, entry + 2))
        # Type 3 is a number of two bytes.
        sizes[tag] = int.from_bytes(data[entry + 8 : entry + (10 if kind == 3 else 12)], order)
    if _WIDTH not in sizes or _HEIGHT not in sizes:
        raise DamagedError('Expected the size of a TIFF image in its first directory, got none.')
    return sizes[_HEIGHT], sizes[_WIDTH]


def _big16(cursor: ByteReader) -> int:
    return int.from_bytes(cursor.take(2), 'big')
