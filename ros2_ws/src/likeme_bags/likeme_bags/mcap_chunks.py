"""The chunks of an MCAP file, decompressed within limits and checked, for the library to read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from zlib import crc32

from likeme_bags.compression import decompress, decompress_prefix
from likeme_bags.errors import DamagedError
from likeme_bags.file_bytes import FileBytes
from likeme_bags.limits import MAX_BLOCK
from likeme_bags.mcap_format import PREFIX, ChunkHead, McapOp, records_in
from likeme_bags.prefetch import Prefetcher

# From the start of an uncompressed chunk's record to its records.
_TO_RECORDS = PREFIX.size + 40
# A record of a kind that MCAP does not have: readers skip it.
_NO_OP = 0x7F


class ChunkFile:
    """The file object from which `rosbags.rosbag2.storage_mcap.msgsrc` reads chunks.

    The library decompresses whatever a chunk unpacks to, and one damaged chunk ends its reading.
    Here every chunk is uncompressed already, and a damaged one is an empty record of its size.
    """

    def __init__(
        self, file: FileBytes, heads: Sequence[ChunkHead], lost: Callable[[str], None]
    ) -> None:
        """lost: told why a chunk cannot be read, once."""
        self.heads = heads
        # Bytes of a chunk up to its first damaged record, as far as that is known.
        self.whole: dict[int, int] = {}
        # Messages that a chunk without a checksum should hold, as far as that is known.
        self.counts: Sequence[int] = ()
        # The number of a chunk that the end of the file cuts off.
        self.cut = -1
        self._file, self._lost = file, lost
        self._numbers = {head.offset: number for number, head in enumerate(heads)}
        self._unreadable: set[int] = set()
        self._prefetch = Prefetcher(self._decompressed, self._size_of)
        self._at = 0
        self.close = self._prefetch.close

    def seek(self, at: int) -> int:
        """Go to an offset of the file."""
        self._at = at
        return at

    def tell(self) -> int:
        """Where the next read begins."""
        return self._at

    def read(self, size: int) -> bytes:
        """The records of the chunk that lie here; else its checksum: none, as it was checked."""
        number = self._numbers.get(self._at - _TO_RECORDS)
        if number is None:
            return bytes(4)
        content = self.content(number)
        if content is None:
            return PREFIX.pack(_NO_OP, size - PREFIX.size) + bytes(size - PREFIX.size)
        return content

    def content(self, number: int) -> bytes | None:
        """The records of a chunk; None, with a warning, when it is damaged."""
        if number in self._unreadable:
            return None
        try:
            content = self._prefetch.get(number)
        except DamagedError as error:
            self._unreadable.add(number)
            self._lost(f'chunk {number} cannot be read: {error}')
            return None
        return content[: self.whole.get(number, len(content))]

    def _size_of(self, number: int) -> int:
        return self.heads[number].size if number < len(self.heads) else 0

    def _decompressed(self, number: int) -> bytes:
        """A chunk, checked; called by other threads, too."""
        head = self.heads[number]
        size = max(head.stored, head.size)
        if size > MAX_BLOCK:
            raise DamagedError(f'Expected at most {MAX_BLOCK} bytes in a chunk, got {size}.')
        stored = self._file.read(head.at, head.stored)
        if number == self.cut:
            return decompress_prefix(stored, head.method, head.size)
        data = decompress(stored, head.method, head.size)
        if head.crc and crc32(data) != head.crc:
            raise DamagedError(
                f'Expected a chunk with checksum {head.crc:08x}, got {crc32(data):08x}.'
            )
        if not head.crc and self.counts:
            count = sum(op == McapOp.MESSAGE for op, _, _ in records_in(data))
            if count != self.counts[number]:
                expected = self.counts[number]
                raise DamagedError(f'Expected {expected} messages in a chunk, got {count}.')
        return data
