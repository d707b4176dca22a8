"""Any bag as one stream of records in the order of their log times.

A rosbag2 folder (sqlite3 or MCAP, split, compressed, metadata versions 1 to 9), a loose storage
file, or a ROS 1 bag, whose messages are converted. Whatever cannot be passed on is said in
`Bag.warnings`, and `Bag.complete` is False then.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from likeme_bags.bag_files import BagFiles, find_files, kind_of
from likeme_bags.bag_warnings import BagWarning, BagWarnings, Subject
from likeme_bags.channel_streams import streams_of, topics_of
from likeme_bags.errors import BagError, DamagedError
from likeme_bags.mcap_reader import McapStorage
from likeme_bags.ros1_reader import Ros1Storage
from likeme_bags.rosbag2_compression import compression_of, decompress_file
from likeme_bags.sorted_copy import temporary_folder
from likeme_bags.sqlite_reader import SqliteStorage
from likeme_bags.storage import Attachment, Storage, read
from likeme_bags.values import Record, Topic

__all__ = ['Bag', 'Record', 'Topic', 'open_bag']

_Numbered = tuple[int, int, Record | None]


class Bag:
    """An opened bag. Not to be made directly: see `open_bag`."""

    def __init__(
        self,
        path: Path,
        found: BagFiles,
        storages: list[Storage],
        log: BagWarnings,
        opened: ExitStack,
    ) -> None:
        """opened: what has to be closed in the end; taken over when nothing can fail any more."""
        self.path = path
        self.files = found.files
        self.metadata = found.metadata
        self._log = log
        self._storages = storages
        streams = streams_of(storages, found.metadata, log)
        self._streams = [
            {stream.channel: stream for stream in streams if stream.file == number}
            for number in range(len(storages))
        ]
        self.topics: tuple[Topic, ...] = topics_of(streams)
        used = [s for s in storages if any(s.counts.values())]
        #: Log times of the first and the last message, ns; 0 when there is none.
        self.start = min((storage.span[0] for storage in used), default=0)
        self.end = max((storage.span[1] for storage in used), default=0)
        self._stack = opened.pop_all()

    @property
    def count(self) -> int:
        """Number of messages that can be passed on."""
        return sum(topic.count for topic in self.topics)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is wrong with the bag; grows while records are read."""
        return self._log.sentences()

    @property
    def all_warnings(self) -> tuple[BagWarning, ...]:
        """The warnings with what they are about."""
        return tuple(self._log.all)

    @property
    def complete(self) -> bool:
        """Whether nothing is known or feared missing, as far as the bag was read."""
        return self._log.complete

    @property
    def checksums(self) -> bool:
        """Whether checksums cover every message: sqlite3 has none, rosbag2's MCAP not always."""
        return all(storage.checksums for storage in self._storages)

    @property
    def attachments(self) -> tuple[Attachment, ...]:
        """Attachments and metadata records of MCAP files."""
        return tuple(each for storage in self._storages for each in storage.attachments)

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
        parts = (self._file(k, topics, start, end) for k in range(len(self._storages)))
        for _, _, record in heapq.merge(*parts, key=lambda each: each[:2]):
            if record is not None:
                yield record

    def _file(
        self, number: int, topics: Collection[str] | None, start: int | None, end: int | None
    ) -> Iterator[_Numbered]:
        """Log time, number of the file and record of one file's messages.

        Before them their first log time: so a file is read when it is its turn.
        """
        storage, streams = self._storages[number], self._streams[number]
        chosen = {k: s for k, s in streams.items() if topics is None or s.topic.name in topics}
        counts = storage.counts
        if not any(counts.get(key) for key in chosen):
            return
        yield max(storage.span[0], start or 0), -1, None
        for channel, stamp, data in read(storage, chosen, start, end, self._log):
            yield stamp, number, chosen[channel].record(stamp, data, self._log)

    def stamps(self, topic: str) -> NDArray[np.int64]:
        """Log times of a topic's messages, ns, rising; shape (n,)."""
        found = [
            stream.storage.stamps(stream.channel)
            for streams in self._streams
            for stream in streams.values()
            if stream.topic.name == topic
        ]
        return np.sort(np.concatenate(found)) if found else np.zeros(0, np.int64)

    def close(self) -> None:
        """Let go of all files."""
        self._stack.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_bag(path: Path | str, thorough: bool = False, to_repair: bool = False) -> Bag:
    """Open a bag.

    thorough: check every chunk now instead of when it is read, as tools that judge a bag do.
    to_repair: also take what can be had of a chunk that was cut, which no checksum vouches for.

    Raises:
        BagError: it is no bag, or nothing in it can be used.
    """
    log = BagWarnings()
    found = find_files(Path(path), log)
    with ExitStack() as stack:
        storages = []
        for file in found.files:
            try:
                storages.append(_open_file(file, log, stack, thorough, to_repair))
            except BagError as error:
                if len(found.files) == 1:
                    raise BagError(str(error)) from None
                log.loss(Subject.FILES, str(error))
        if not storages:
            raise BagError(log.sentences()[-1])
        return Bag(Path(path), found, storages, log, stack)


def _open_file(
    file: Path, log: BagWarnings, stack: ExitStack, thorough: bool, to_repair: bool
) -> Storage:
    storage: Storage
    try:
        with file.open('rb') as opened:
            begin = opened.read(4)
        if not begin:
            raise BagError(f'Expected a bag, got {file.name} of 0 bytes.')
        if compression_of(begin):
            file = decompress_file(file, temporary_folder(stack), log)
        if kind_of(file) == '.mcap':
            storage = McapStorage(file, log, thorough, to_repair)
        elif kind_of(file) == '.db3':
            storage = SqliteStorage(file, log, thorough)
        else:
            storage = Ros1Storage(file, log, thorough, to_repair)
    except DamagedError as error:
        raise BagError(f'{file.name} is not a bag: {error}') from None
    except OSError as error:
        raise BagError(f'Cannot open {file}: {error.strerror}.') from None
    stack.callback(storage.release)
    return storage
