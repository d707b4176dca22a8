"""What a bag has the cores do, in an order that depends on the bag alone: frames and cues.

A frame is a colour image and the depth image of its stamp, with the camera_info that counted then.
A bag of a live run also tells which frames perception read (`frame_done`) and what the session
took in (`heard`): only those frames are shown again, and the session hears the same things in the
same order. A bag of images alone gives a cue for every table state and demonstration they lead to.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from likeme_bags.adapting import CAMERA_INFO, COLOUR, DEPTH, INFO
from likeme_bags.errors import BagError
from likeme_bags.headers import header_stamp
from likeme_bags.images import IMAGE
from likeme_bags.values import Record
from likeme_inference.input_sequencer import Cue, Input
from likeme_perception.pairing import StampPairing
from likeme_replay.message_definitions import definitions

FRAME_DONE, HEARD = 'frame_done', 'heard'
NEEDED: Mapping[str, str] = {COLOUR: IMAGE, INFO: CAMERA_INFO, DEPTH: IMAGE}
#: Of likeme_msgs/FrameDone.
READ = 1
#: A frame this many frames older than the newest that was read was not read at all.
PATIENCE = 64


class Frame(NamedTuple):
    """One frame to show, and its header stamp in ns."""

    stamp: int
    info: Record
    colour: Record
    depth: Record


Step = Frame | Cue


def check_topics(topics: Mapping[str, str], path: object) -> None:
    """Refuse a bag that has not what perception needs.

    Raises:
        BagError: the topic, what was expected and what the bag holds.
    """
    for name, kind in NEEDED.items():
        if name not in topics:
            held = ', '.join(f'{n} ({t})' for n, t in sorted(topics.items())) or 'nothing'
            raise BagError(
                f'{path}: expected the topic {name} ({kind}), got {held}; --remap gives a topic '
                'another name.'
            )
        if topics[name] != kind:
            raise BagError(f'{path}: expected {name} as {kind}, got {topics[name]}.')


class Source(NamedTuple):
    """Records in the order of a bag, with the topics' names as the cell knows them."""

    name: str
    topics: Mapping[str, str]
    records: Iterator[Record]


class Script:
    """Reads the steps of a bag, one after another.

    Attributes:
        live: whether the bag tells what a live session heard.
        unpaired, unread, unreadable: images without a partner, frames the live run did not read,
            and messages that are not what their type says; none is shown. Counted while `steps`
            runs.
    """

    def __init__(self, source: Source) -> None:
        """Refuses what cannot be replayed with a BagError."""
        check_topics(source.topics, source.name)
        self._records = source.records
        self.live = HEARD in source.topics
        self._knows_read = FRAME_DONE in source.topics
        self._pairs: StampPairing[Record] = StampPairing(0.016, lambda r: header_stamp(r.data))
        self._held: deque[Frame] = deque()
        self._early: deque[tuple[Record, Record]] = deque()
        self._read: set[int] = set()
        self._newest = 0
        self._info: Record | None = None
        self.unread = self.unreadable = 0

    @property
    def unpaired(self) -> int:
        """Images that had no partner of their stamp."""
        return self._pairs.unpaired

    def steps(self) -> Iterator[Step]:
        """Frames and cues in their order."""
        for record in self._records:
            try:
                message = definitions().read(record.data, record.type)
            except ValueError:
                self.unreadable += 1
                continue
            if record.topic == INFO:
                yield from self._take_info(record)
            elif record.topic in (COLOUR, DEPTH):
                pair = self._pairs.add(int(record.topic == DEPTH), record)
                if pair is not None:
                    yield from self._take_pair(*pair)
            elif record.topic == FRAME_DONE:
                if message.kind == READ:
                    yield from self._take_read(header_stamp(record.data))
            elif message.kind in set(Input) and message.kind != Input.NOTHING:
                yield Cue(Input(message.kind), header_stamp(record.data), message)
        yield from self._release(len(self._held))

    def _take_info(self, record: Record) -> Iterator[Frame]:
        self._info = record
        while self._early:
            yield from self._take_pair(*self._early.popleft())

    def _take_pair(self, colour: Record, depth: Record) -> Iterator[Frame]:
        if self._info is None:
            self._early.append((colour, depth))
            self.unread += len(self._early) > PATIENCE
            if len(self._early) > PATIENCE:
                self._early.popleft()
            return
        frame = Frame(header_stamp(depth.data), self._info, colour, depth)
        if not self._knows_read:
            yield frame
            return
        self._held.append(frame)
        whole = frame.stamp in self._read
        yield from self._release(len(self._held) if whole else len(self._held) - PATIENCE)

    def _take_read(self, stamp: int) -> Iterator[Frame]:
        self._read.add(stamp)
        stamps = [frame.stamp for frame in self._held]
        if stamp in stamps:
            yield from self._release(stamps.index(stamp) + 1)

    def _release(self, count: int) -> Iterator[Frame]:
        """Let go of the oldest frames: those that were read are shown."""
        for _ in range(count):
            frame = self._held.popleft()
            if frame.stamp in self._read:
                self._read.discard(frame.stamp)
                yield frame
            else:
                self.unread += 1
