"""Bytes of a file by offset; never more than there are, never more than was asked for."""

from __future__ import annotations

import os
from pathlib import Path

from likeme_bags.errors import BagError, DamagedError
from likeme_bags.limits import MAX_TEXT


class FileBytes:
    """An opened file of a size that is read once."""

    def __init__(self, path: Path) -> None:
        self.path, self.name = path, path.name
        try:
            self._handle = os.open(path, os.O_RDONLY)
        except OSError as error:
            raise BagError(f'Cannot open {path}: {error.strerror}.') from None
        self.size = os.fstat(self._handle).st_size

    def read(self, at: int, size: int) -> bytes:
        """Up to `size` bytes; fewer at the end of the file."""
        if at >= self.size or size <= 0:
            return b''
        size = min(size, self.size - at)
        try:
            data = os.pread(self._handle, size, at)
            # One call gives at most 2 GiB, and less when a signal comes between.
            while len(data) < size and (
                more := os.pread(self._handle, size - len(data), at + len(data))
            ):
                data += more
        except OSError as error:
            raise BagError(f'Cannot read {self.name}: {error.strerror}.') from None
        return data

    def text(self, at: int, size: int) -> bytes:
        """Exactly `size` bytes of something that is not a message: its size is bounded.

        Raises:
            DamagedError: longer than such a thing can be, or not all there.
        """
        if size > MAX_TEXT:
            raise DamagedError(f'Expected at most {MAX_TEXT} bytes of description, got {size}.')
        data = self.read(at, size)
        if len(data) != size:
            raise DamagedError(f'Expected {size} bytes at {at}, got {len(data)}.')
        return data

    def close(self) -> None:
        """Let go of the file; twice does no harm."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1
