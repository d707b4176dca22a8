"""What the reader of every kind of storage file offers, and reading on where the library fails."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    MessageDefinition,
    MessageDefinitionFormat,
)

from likeme_bags.bag_warnings import BagWarnings, Subject
from likeme_bags.errors import READ_ERRORS, DamagedError
from likeme_bags.file_bytes import FileBytes

MAX_STAMP = 2**63 - 1
# An attachment is copied in parts of this size, bytes.
_PART = 2**20


class Channel(NamedTuple):
    """What a storage file says of one of its topics, unchecked."""

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

    def connection(self, key: int) -> Connection:
        """The channel as the library's readers of rosbag2 files need it to find messages."""
        undefined = MessageDefinition(MessageDefinitionFormat.NONE, '')
        return Connection(
            key, self.topic, self.type, undefined, '', 0, ConnectionExtRosbag2('cdr', []), None
        )


class Attachment(NamedTuple):
    """An attachment or a metadata record of an MCAP file, as it stands in the file."""

    kind: str
    name: str
    file: FileBytes
    # Offset and size of the record.
    at: int
    size: int

    def parts(self) -> Iterator[bytes]:
        """The record, in parts that fit into memory."""
        for at in range(self.at, self.at + self.size, _PART):
            yield self.file.read(at, min(_PART, self.at + self.size - at))

    def __str__(self) -> str:
        return f"{self.kind} '{self.name}' ({self.size} bytes)"


class Storage(ABC):
    """One opened file, whose index is checked and whose messages the library reads."""

    def __init__(self, path: Path, log: BagWarnings, to_repair: bool = False) -> None:
        """to_repair: a file that ends too early is no loss, and its cut end is read, too."""
        self.name = path.name
        self.attachments: list[Attachment] = []
        self._path, self._log, self._to_repair = path, log, to_repair
        self._opened = ExitStack()
        self._salvaged = False

    @property
    @abstractmethod
    def channels(self) -> Mapping[int, Channel]:
        """All topics by id."""

    @property
    def connections(self) -> Collection[Connection]:
        """The topics for `messages`, by the same ids."""
        return [channel.connection(key) for key, channel in self.channels.items()]

    @property
    @abstractmethod
    def counts(self) -> Mapping[int, int]:
        """Messages by id of their channel."""

    @property
    @abstractmethod
    def span(self) -> tuple[int, int]:
        """Log times of the first and the last message, ns; only when there are messages."""

    @property
    @abstractmethod
    def checksums(self) -> bool:
        """Whether checksums cover every message, so that a flipped bit is noticed."""

    @abstractmethod
    def messages(
        self, connections: Collection[Connection], start: int | None, stop: int | None
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Messages in the order of log times, as the library reads them."""

    @abstractmethod
    def stamps(self, channel: int) -> NDArray[np.int64]:
        """Log times of a channel's messages, ns, rising; shape (n,)."""

    @abstractmethod
    def _index_content(self) -> None:
        """Index the file by its content, without what is damaged."""

    def salvage(self, why: str) -> bool:
        """Index the file by its content, as its index failed; False when that was done before."""
        if self._salvaged:
            return False
        self._salvaged = True
        self._log.loss(Subject.CHUNKS, f'{self.name} is damaged: {why.splitlines()[-1]}')
        self._index_content()
        return True

    def release(self) -> None:
        """Close the file, and remove temporary copies."""
        self._opened.close()

    def _lose(self, why: str) -> None:
        self._log.lost(self.name, why)


def read(
    storage: Storage, ids: Collection[int], start: int | None, stop: int | None, log: BagWarnings
) -> Iterator[tuple[int, int, bytes]]:
    """Channel, log time (ns) and data of messages, start <= log time < stop, by their log times.

    Where the library fails, the file is salvaged, and reading goes on behind the last message.
    """
    last, passed, total = -1, 0, 0
    while True:
        again = passed
        chosen = [c for c in storage.connections if c.id in ids]
        begin = start if last < 0 else last
        try:
            for connection, stamp, data in storage.messages(chosen, begin, stop) if chosen else ():
                valid = isinstance(stamp, int) and 0 <= stamp <= MAX_STAMP
                if not valid or not isinstance(data, bytes) or connection.id not in ids:
                    log.lost(storage.name, f'the message at {stamp!r} ns is damaged')
                    continue
                if stamp < last:
                    raise DamagedError('Expected messages in the order of their log times.')
                if again and stamp == last:
                    again -= 1
                    continue
                passed = passed + 1 if stamp == last else 1
                last, total = stamp, total + 1
                yield connection.id, stamp, data
        except READ_ERRORS as error:
            if storage.salvage(str(error) or repr(error)):
                continue
            log.lost(storage.name, f'reading ends at {last} ns: {error}')
            return
        counts = storage.counts
        expected = sum(counts.get(key, 0) for key in ids)
        if start is None and stop is None and total < expected:
            log.lost(storage.name, f'{total} messages read, expected {expected}')
        return
