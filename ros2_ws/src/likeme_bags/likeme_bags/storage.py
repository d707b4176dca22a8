"""What every kind of storage file offers to `reading`, and the cache of decompressed chunks."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from typing import Generic, NamedTuple, Protocol, TypeVar

from likeme_bags.index import Index
from likeme_bags.limits import MAX_CACHE

T = TypeVar('T')


class Channel(NamedTuple):
    """What a storage file says of one of its topics, unjudged."""

    topic: str
    type: str
    # 'cdr', 'ros1', or what else the file claims.
    serialization: str = 'cdr'
    # Offered profiles as YAML.
    qos: str = ''
    definition: str = ''
    # 'ros2msg', 'ros2idl', 'ros1msg' or ''.
    encoding: str = ''
    type_hash: str = ''


class Storage(Protocol):
    """One opened file. Messages are addressed by their place in `index`."""

    @property
    def index(self) -> Index:
        """All messages."""

    @property
    def channels(self) -> Mapping[int, Channel]:
        """All topics, by the number the index knows them by."""

    @property
    def checksums(self) -> bool:
        """Whether checksums cover every message, so that a flipped bit is noticed."""

    def fetch(self, stamp: int, channel: int, block: int, offset: int) -> bytes | None:
        """The message's bytes; None, with a note, when they are not what the index promised."""

    def close(self) -> None:
        """Let go of the file."""


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
