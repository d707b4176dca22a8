"""Any bag as one stream of records in the order of their log times.

A rosbag2 folder (sqlite3 or MCAP, split, compressed, metadata versions 1 to 9), a loose storage
file, or a ROS 1 bag, whose messages are converted. Whatever cannot be passed on is said in
`Bag.warnings`, and `Bag.complete` is False then.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Self

import numpy as np
from numpy.typing import NDArray

from likeme_bags.bag_files import Found, find, kind_of
from likeme_bags.bag_warnings import About, Note, Notes
from likeme_bags.channel_streams import Stream, streams_of, topics_of
from likeme_bags.errors import BagError, DamagedError
from likeme_bags.mcap_reader import McapStorage
from likeme_bags.ros1_reader import Ros1Storage
from likeme_bags.rosbag2_compression import unpack_file
from likeme_bags.sqlite_reader import SqliteStorage
from likeme_bags.storage import Storage
from likeme_bags.values import Record, Topic

__all__ = ['Bag', 'Record', 'Topic', 'open_bag']

# Messages looked up at once, so that a long bag's index is not turned into Python numbers at once.
_STEP = 4096


class Bag:
    """An opened bag. Not to be made directly: see `open_bag`."""

    def __init__(
        self, path: Path, found: Found, streams: list[Stream], notes: Notes, opened: ExitStack
    ) -> None:
        """opened: what has to be closed in the end; taken over when nothing can fail any more."""
        self.path = path
        self.files = found.files
        self.metadata = found.metadata
        self._notes = notes
        self._streams = streams
        self._stamps, self._stream, self._place = _in_order(streams)
        self.topics: tuple[Topic, ...] = topics_of(streams)
        self._stack = opened.pop_all()

    @property
    def count(self) -> int:
        """Number of messages that can be passed on."""
        return len(self._stamps)

    @property
    def start(self) -> int:
        """Log time of the first message, ns; 0 when there is none."""
        return int(self._stamps[0]) if self.count else 0

    @property
    def end(self) -> int:
        """Log time of the last message, ns; 0 when there is none."""
        return int(self._stamps[-1]) if self.count else 0

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is wrong with the bag; grows while records are read."""
        return self._notes.told()

    @property
    def notes(self) -> tuple[Note, ...]:
        """The warnings with what they are about."""
        return tuple(self._notes.all)

    @property
    def complete(self) -> bool:
        """Whether nothing is known or feared missing, as far as the bag was read."""
        return self._notes.complete

    @property
    def checksums(self) -> bool:
        """Whether checksums cover every message: sqlite3 has none, rosbag2's MCAP not always."""
        return all(stream.storage.checksums for stream in self._streams)

    @property
    def custom(self) -> Mapping[str, str]:
        """custom_data of metadata.yaml."""
        return self.metadata.custom if self.metadata else {}

    def records(
        self,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
    ) -> Iterator[Record]:
        """Records in the order of their log times (ns), start <= stamp < end.

        topics: only these; None: all. Several iterations may run at once.
        """
        first = 0 if start is None else int(np.searchsorted(self._stamps, start, 'left'))
        last = self.count if end is None else int(np.searchsorted(self._stamps, end, 'left'))
        wanted = np.array([topics is None or s.topic.name in topics for s in self._streams], bool)
        for begin in range(first, last, _STEP):
            part = slice(begin, min(begin + _STEP, last))
            chosen = np.flatnonzero(wanted[self._stream[part]]) + begin
            rows = zip(self._stream[chosen].tolist(), self._place[chosen].tolist(), strict=True)
            for number, place in rows:
                stream = self._streams[number]
                record = stream.record(place, self._notes)
                if record is not None:
                    yield record

    def stamps(self, topic: str) -> NDArray[np.int64]:
        """Log times of a topic's messages, ns, rising; shape (n,)."""
        wanted = np.array([s.topic.name == topic for s in self._streams], bool)
        return self._stamps[wanted[self._stream]] if len(wanted) else self._stamps

    def close(self) -> None:
        """Let go of all files."""
        self._stack.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_bag(path: Path | str, thorough: bool = False, salvage: bool = False) -> Bag:
    """Open a bag and find every message in it.

    thorough: check every chunk now instead of when it is read, as tools that judge a bag do.
    salvage: also take what can be had of a chunk that was cut, which no checksum vouches for.

    Raises:
        BagError: it is no bag, or nothing in it can be used.
    """
    notes = Notes()
    found = find(Path(path), notes)
    with ExitStack() as stack:
        storages = []
        for file in found.files:
            try:
                storages.append(_open_file(file, notes, stack, thorough, salvage))
            except BagError as error:
                if len(found.files) == 1:
                    raise BagError(str(error)) from None
                notes.loss(About.FILES, str(error))
        if not storages:
            raise BagError(notes.told()[-1])
        streams = streams_of(storages, found.metadata, notes)
        return Bag(Path(path), found, streams, notes, stack)


def _open_file(
    file: Path, notes: Notes, stack: ExitStack, thorough: bool, salvage: bool
) -> Storage:
    if file.name.endswith('.zstd'):
        folder = stack.enter_context(TemporaryDirectory(prefix='likeme-bag-'))
        file = unpack_file(file, Path(folder), notes)
    storage: Storage
    try:
        if file.stat().st_size == 0:
            raise BagError(f'Expected a bag, got {file.name} of 0 bytes.')
        if kind_of(file) == '.mcap':
            storage = McapStorage(file, notes, thorough, salvage)
        elif kind_of(file) == '.db3':
            storage = SqliteStorage(file, notes, thorough)
        else:
            storage = Ros1Storage(file, notes, salvage)
    except DamagedError as error:
        raise BagError(f'{file.name} is not a bag: {error}') from None
    except OSError as error:
        raise BagError(f'Cannot open {file}: {error.strerror}.') from None
    stack.callback(storage.close)
    return storage


def _in_order(
    streams: list[Stream],
) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.int64]]:
    """Log time, stream, and place in the stream of all messages, by log time, then as written."""
    if not streams:
        return np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros(0, np.int64)
    stamps = np.concatenate([s.stamps for s in streams])
    numbers = np.repeat(np.arange(len(streams), dtype=np.int32), [len(s.stamps) for s in streams])
    places = np.concatenate([s.places for s in streams])
    files = np.repeat([s.file for s in streams], [len(s.stamps) for s in streams])
    order = np.lexsort((places, files, stamps))
    return stamps[order], numbers[order], places[order]
