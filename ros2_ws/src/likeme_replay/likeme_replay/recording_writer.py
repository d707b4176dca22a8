"""The thread that writes what a recorder hears, so that hearing never waits for a disk."""

from __future__ import annotations

import queue
import threading
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Future
from typing import NamedTuple

from rosbags.interfaces import Connection, Qos

from likeme_bags.durable import DurableMcap, DurableWriter
from likeme_replay.message_definitions import Definition

#: s between two points up to which a killed recorder has lost nothing.
FLUSH_PERIOD = 0.5
#: Bytes that may wait to be written; what comes beyond is lost, and told.
ROOM = 512 * 2**20
#: zstd, for two cameras on one of two cores.
LEVEL = 1


class Heard(NamedTuple):
    """A message and when it was received, ns."""

    topic: str
    stamp: int
    data: bytes


class Channel(NamedTuple):
    """A topic as its publishers offer it."""

    topic: str
    type: str
    definition: Definition
    qos: tuple[Qos, ...]


class Recording:
    """A bag that grows; `take` may be called from any thread and returns at once.

    Attributes:
        counts: messages written, by topic.
        lost: messages there was no room for, by topic.
        error: why writing ended early, or nothing.
    """

    def __init__(self, writer: DurableWriter) -> None:
        self.counts: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()
        self.error = ''
        self._writer = writer
        self._queue: queue.SimpleQueue[Heard | Channel | None] = queue.SimpleQueue()
        self._waiting = 0
        self._connections: dict[str, Connection] = {}
        self._begun: Future[None] = Future()
        self._thread = threading.Thread(target=self._run, name='writer')

    def start(self) -> None:
        """Begin the bag.

        Raises:
            BagError, OSError: it cannot be begun.
        """
        self._thread.start()
        self._begun.result()

    def add(self, channel: Channel) -> None:
        """A topic, before its first message."""
        self.counts[channel.topic] += 0
        self._queue.put(channel)

    def take(self, heard: Heard) -> None:
        """A message of a topic that was added."""
        if self.error or self._waiting + len(heard.data) > ROOM:
            self.lost[heard.topic] += 1
            return
        self._waiting += len(heard.data)
        self._queue.put(heard)

    def remark(self, key: str, value: str) -> None:
        """Something about the whole bag, for metadata.yaml."""
        self._writer.set_custom_data(key, value)

    def finish(self) -> None:
        """Write what is left and close the bag."""
        self._queue.put(None)
        self._thread.join()

    def _run(self) -> None:
        """Open, write and close: sqlite3 wants all of it in one thread."""
        try:
            self._writer.open()
            if isinstance(self._writer.storage, DurableMcap):
                self._writer.storage.level = LEVEL
        except Exception as error:
            self._begun.set_exception(error)
            return
        self._begun.set_result(None)
        try:
            self._write_all()
            self._writer.close()
        except Exception as error:
            # A full disk is the usual one: what was flushed stays, and the recorder tells.
            self.error = f'{type(error).__name__}: {error}'
            self._writer.abort()

    def _write_all(self) -> None:
        due, dirty = time.monotonic() + FLUSH_PERIOD, False
        while True:
            try:
                item = self._queue.get(timeout=max(0.0, due - time.monotonic()))
            except queue.Empty:
                item = ()  # type: ignore[assignment]
            if item is None:
                return
            if item:
                self._write(item)
                dirty = True
            if time.monotonic() >= due:
                if dirty:
                    self._writer.flush()
                due, dirty = time.monotonic() + FLUSH_PERIOD, False

    def _write(self, item: Heard | Channel) -> None:
        if isinstance(item, Channel):
            self._connections[item.topic] = self._writer.add_connection(
                item.topic, item.type, msgdef=item.definition.text,
                rihs01=item.definition.digest, offered_qos_profiles=item.qos,
            )  # fmt: skip
            return
        self._writer.write(self._connections[item.topic], item.stamp, item.data)
        self._waiting -= len(item.data)
        self.counts[item.topic] += 1


def summary(counts: Counter[str], wanted: Sequence[str]) -> list[str]:
    """How many messages of each topic, and which topics nobody ever published."""
    lines = [f'{count:7d}  {topic}' for topic, count in sorted(counts.items())]
    silent = [topic for topic in wanted if topic not in counts]
    return [*lines, f'never there: {", ".join(silent)}'] if silent else lines
