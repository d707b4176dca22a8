"""The writer thread of a recorder: receiving never waits for the disk."""

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

#: s between two flushes: a killed recorder loses no more than this.
FLUSH_PERIOD = 0.5
#: Bytes that may wait to be written; messages beyond are lost and counted.
MAX_QUEUED_BYTES = 512 * 2**20
#: Level of zstd: two cameras on one of two cores.
ZSTD_LEVEL = 1


class ReceivedMessage(NamedTuple):
    """A message and when it was received, ns."""

    topic: str
    stamp: int
    data: bytes


class RecordedTopic(NamedTuple):
    """A topic as its publishers offer it."""

    topic: str
    type: str
    definition: Definition
    qos: tuple[Qos, ...]


class Recording:
    """A bag being written; `add` may be called from any thread and returns at once.

    Attributes:
        counts: messages written, by topic.
        lost: messages dropped because the queue was full, by topic.
        error: why writing ended early, or ''.
    """

    def __init__(self, writer: DurableWriter) -> None:
        self.counts: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()
        self.error = ''
        self._writer = writer
        self._queue: queue.SimpleQueue[ReceivedMessage | RecordedTopic | None] = (
            queue.SimpleQueue()
        )
        self._queued_bytes = 0
        self._connections: dict[str, Connection] = {}
        self._opened: Future[None] = Future()
        self._thread = threading.Thread(target=self._run, name='writer')

    def start(self) -> None:
        """Open the bag.

        Raises:
            BagError, OSError: it cannot be opened.
        """
        self._thread.start()
        self._opened.result()

    def add_topic(self, topic: RecordedTopic) -> None:
        """Add a topic, before its first message."""
        self.counts[topic.topic] += 0
        self._queue.put(topic)

    def add(self, message: ReceivedMessage) -> None:
        """Add a message of a topic that was added."""
        if self.error or self._queued_bytes + len(message.data) > MAX_QUEUED_BYTES:
            self.lost[message.topic] += 1
            return
        self._queued_bytes += len(message.data)
        self._queue.put(message)

    def set_metadata(self, key: str, value: str) -> None:
        """Set an entry of the custom data in metadata.yaml."""
        self._writer.set_custom_data(key, value)

    def finish(self) -> None:
        """Write queued messages and close the bag."""
        self._queue.put(None)
        self._thread.join()

    def _run(self) -> None:
        """Open, write and close: sqlite3 requires a single thread."""
        try:
            self._writer.open()
            if isinstance(self._writer.storage, DurableMcap):
                self._writer.storage.level = ZSTD_LEVEL
        except Exception as error:
            self._opened.set_exception(error)
            return
        self._opened.set_result(None)
        try:
            self._write_all()
            self._writer.close()
        except Exception as error:
            # Usually a full disk: flushed data stays, and the recorder reports it.
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

    def _write(self, item: ReceivedMessage | RecordedTopic) -> None:
        if isinstance(item, RecordedTopic):
            self._connections[item.topic] = self._writer.add_connection(
                item.topic, item.type, msgdef=item.definition.text,
                rihs01=item.definition.digest, offered_qos_profiles=item.qos,
            )  # fmt: skip
            return
        self._writer.write(self._connections[item.topic], item.stamp, item.data)
        self._queued_bytes -= len(item.data)
        self.counts[item.topic] += 1


def summary(counts: Counter[str], wanted: Sequence[str]) -> list[str]:
    """Counts of messages by topic, and the topics that were never published."""
    lines = [f'{count:7d}  {topic}' for topic, count in sorted(counts.items())]
    missing = [topic for topic in wanted if topic not in counts]
    return [*lines, f'never published: {", ".join(missing)}'] if missing else lines
