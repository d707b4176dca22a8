"""Decompressed chunks that may be asked for again."""

from __future__ import annotations

from collections import OrderedDict
from typing import Generic, TypeVar

from likeme_bags.limits import MAX_CACHE

T = TypeVar('T')


class BlockCache(Generic[T]):
    """The last used chunks, as many as fit; the newest always does."""

    def __init__(self) -> None:
        self._blocks: OrderedDict[int, tuple[T, int]] = OrderedDict()
        self._held = 0

    def get(self, key: int) -> T | None:
        """The chunk, or None when it was never put or has been dropped."""
        entry = self._blocks.get(key)
        if entry is None:
            return None
        self._blocks.move_to_end(key)
        return entry[0]

    def put(self, key: int, block: T, size: int) -> None:
        """Keep a chunk of `size` bytes, dropping the longest unused ones."""
        while self._blocks and self._held + size > MAX_CACHE:
            self._held -= self._blocks.popitem(last=False)[1][1]
        self._blocks[key] = (block, size)
        self._held += size
