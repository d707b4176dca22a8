"""How large a PNG or JPEG claims to be, read before anything is allocated for it."""

from __future__ import annotations

from likeme_bags.byte_reader import ByteReader
from likeme_bags.errors import DamagedError

_PNG = b'\x89PNG\r\n\x1a\n'
# Start-of-frame markers of JPEG; C4, C8 and CC are other things.
_FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}
# Markers without a length behind them.
_BARE = {0x01, *range(0xD0, 0xD9)}


def claimed_size(data: bytes | memoryview) -> tuple[int, int]:
    """Height and width, pixels.

    Raises:
        DamagedError: neither PNG nor JPEG, or cut before the size.
    """
    begin = bytes(data[:24])
    if begin.startswith(_PNG) and len(begin) == 24:
        return int.from_bytes(begin[20:24], 'big'), int.from_bytes(begin[16:20], 'big')
    if begin.startswith(b'\xff\xd8'):
        return _jpeg_size(ByteReader(data, 2))
    raise DamagedError(f'Expected a PNG or JPEG image, got bytes that begin with {begin[:8]!r}.')


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


def _big16(cursor: ByteReader) -> int:
    return int.from_bytes(cursor.take(2), 'big')
