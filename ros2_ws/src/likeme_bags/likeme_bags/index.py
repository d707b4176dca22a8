"""Where every message of a storage file lies: 28 bytes a message, however large the messages."""

from __future__ import annotations

from array import array
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from likeme_bags.errors import BagError
from likeme_bags.limits import MAX_MESSAGES

MAX_STAMP = 2**63 - 1


class Index:
    """Grows while a file is scanned; afterwards read by columns of equal length.

    A message is known by (block, offset): in MCAP and ROS 1 the chunk's number (-1: outside any
    chunk) and the byte in it; in sqlite3 the block is 0 and the offset the row id.
    """

    def __init__(self) -> None:
        self._stamps = array('q')
        self._channels = array('q')
        self._blocks = array('i')
        self._offsets = array('q')

    def __len__(self) -> int:
        return len(self._stamps)

    def add(self, stamp: int, channel: int, block: int, offset: int) -> None:
        """One message; stamp in ns, 0 .. 2^63 - 1."""
        if len(self._stamps) >= MAX_MESSAGES:
            raise BagError(f'Expected at most {MAX_MESSAGES} messages in a bag, got more.')
        self._stamps.append(stamp)
        self._channels.append(channel)
        self._blocks.append(block)
        self._offsets.append(offset)

    def extend(self, entries: Iterable[tuple[int, int, int]], block: int) -> None:
        """Messages (stamp, channel, offset) of one block."""
        for stamp, channel, offset in entries:
            self.add(stamp, channel, block, offset)

    @property
    def stamps(self) -> NDArray[np.int64]:
        """Log times, ns."""
        return np.array(self._stamps, np.int64)

    @property
    def channels(self) -> NDArray[np.int64]:
        """Channel ids."""
        return np.array(self._channels, np.int64)

    @property
    def blocks(self) -> NDArray[np.int32]:
        """Numbers of chunks."""
        return np.array(self._blocks, np.int32)

    @property
    def offsets(self) -> NDArray[np.int64]:
        """Bytes into the chunk or the file, or row ids."""
        return np.array(self._offsets, np.int64)
