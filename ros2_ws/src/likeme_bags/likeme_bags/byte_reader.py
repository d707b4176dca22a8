"""Little-endian fields of a buffer; every length is checked before it is used."""

from __future__ import annotations

from likeme_bags.errors import DamagedError


class ByteReader:
    """A position in a buffer."""

    __slots__ = ('at', 'buffer')

    def __init__(self, buffer: bytes | memoryview, at: int = 0) -> None:
        self.buffer = memoryview(buffer)
        self.at = at

    @property
    def left(self) -> int:
        """Bytes not yet read."""
        return len(self.buffer) - self.at

    def take(self, size: int) -> memoryview:
        """The next bytes, not copied."""
        if size > self.left:
            raise DamagedError(f'Expected {size} bytes at {self.at}, got {self.left}.')
        self.at += size
        return self.buffer[self.at - size : self.at]

    def number(self, size: int) -> int:
        """An unsigned number of `size` bytes."""
        return int.from_bytes(self.take(size), 'little')

    def block(self) -> memoryview:
        """Bytes after their length of four bytes."""
        return self.take(self.number(4))

    def text(self) -> str:
        """UTF-8 after its length of four bytes."""
        try:
            return str(self.block(), 'utf-8')
        except UnicodeDecodeError:
            raise DamagedError(f'Expected text before {self.at}, got other bytes.') from None
