"""Reading little-endian fields from bytes whose lengths nobody vouches for."""

from __future__ import annotations

import struct

from likeme_bags.errors import DamagedError

_U16 = struct.Struct('<H')
_U32 = struct.Struct('<I')
_U64 = struct.Struct('<Q')


class Cursor:
    """A position in a buffer; every read is checked against the end before it happens."""

    __slots__ = ('at', 'buffer', 'end')

    def __init__(self, buffer: bytes | memoryview, at: int = 0) -> None:
        self.buffer = memoryview(buffer)
        self.at = at
        self.end = len(buffer)

    @property
    def left(self) -> int:
        """Bytes not yet read."""
        return self.end - self.at

    def take(self, size: int) -> memoryview:
        """The next bytes, not copied."""
        if size > self.left:
            raise DamagedError(f'Expected {size} bytes at {self.at}, got {self.left}.')
        self.at += size
        return self.buffer[self.at - size : self.at]

    def u8(self) -> int:
        """An unsigned byte."""
        return self.take(1)[0]

    def u16(self) -> int:
        """Two bytes."""
        return int(_U16.unpack(self.take(2))[0])

    def u32(self) -> int:
        """Four bytes."""
        return int(_U32.unpack(self.take(4))[0])

    def u64(self) -> int:
        """Eight bytes."""
        return int(_U64.unpack(self.take(8))[0])

    def block(self) -> memoryview:
        """Bytes after their length of four bytes."""
        return self.take(self.u32())

    def text(self) -> str:
        """UTF-8 after its length of four bytes."""
        try:
            return str(self.block(), 'utf-8')
        except UnicodeDecodeError:
            raise DamagedError(f'Expected text before {self.at}, got other bytes.') from None
