"""The frames and session inputs of a bag, in an order that depends on the bag alone.

A frame is a colour image and the depth image of its stamp, with the camera_info in force. A bag of
a live run also holds which frames perception read (`frame_done`) and the inputs of the session
(`heard`): only those frames are shown again, and the session gets the same inputs in the same
order. A bag of images alone holds frames only.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from likeme_bags.camera_topics import CAMERA_INFO, COLOUR, DEPTH, INFO
from likeme_bags.errors import BagError
from likeme_bags.headers import header_stamp
from likeme_bags.images import IMAGE
from likeme_bags.values import Record, Topic
from likeme_inference.session_inputs import InputKind, SessionInput
from likeme_perception.frame_reader import intrinsics_of
from likeme_perception.pairing import StampPairing
from likeme_perception.rgbd import Intrinsics
from likeme_replay.message_definitions import definitions

FRAME_DONE, HEARD = 'frame_done', 'heard'
#: Topics that perception needs, with their types.
CAMERA_TOPICS: Mapping[str, str] = {COLOUR: IMAGE, INFO: CAMERA_INFO, DEPTH: IMAGE}
#: Topics that a replay reads. A topic of another type, by whatever name, is not one of them.
REPLAY_TOPICS: Mapping[str, str] = {
    **CAMERA_TOPICS, FRAME_DONE: 'likeme_msgs/msg/FrameDone', HEARD: 'likeme_msgs/msg/Heard'
}  # fmt: skip
#: Of likeme_msgs/FrameDone.
READ = 1
#: Frames that may wait for their acknowledgement, or for the first camera_info.
MAX_HELD_FRAMES = 64


class RecordedFrame(NamedTuple):
    """One frame, and its header stamp in ns."""

    stamp: int
    info: Record
    colour: Record
    depth: Record


ReplayStep = RecordedFrame | SessionInput


def check_topics(topics: Mapping[str, str], path: object) -> None:
    """Refuse a bag without the topics that perception needs.

    Raises:
        BagError: the topic, what was expected and what the bag holds.
    """
    for name, kind in CAMERA_TOPICS.items():
        if name not in topics:
            held = ', '.join(f'{n} ({t})' for n, t in sorted(topics.items())) or 'nothing'
            raise BagError(
                f'{path}: expected the topic {name} ({kind}), got {held}; --remap gives a topic '
                'another name.'
            )
        if topics[name] != kind:
            raise BagError(f'{path}: expected {name} as {kind}, got {topics[name]}.')


class RecordSource(NamedTuple):
    """The records of a bag in their order, under the cell's topic names.

    recorded: topics as the bag defines them, whose messages may have other fields than today.
    """

    name: str
    topics: Mapping[str, str]
    records: Iterator[Record]
    recorded: Mapping[str, Topic] = {}


class RecordedInputs:
    """Reads the steps of a bag.

    Attributes:
        live: whether the bag holds the inputs of a live session.
        unpaired, unread, unreadable: images without a partner, frames that the live run did not
            read, messages that do not fit their type; none is shown.
        info_changes: how often camera_info changed. All are counted while `steps` runs.
    """

    def __init__(self, source: RecordSource) -> None:
        """Raises BagError for a bag that cannot be replayed."""
        check_topics(source.topics, source.name)
        self._records, self._recorded = source.records, source.recorded
        types = {name: source.topics.get(name) == kind for name, kind in REPLAY_TOPICS.items()}
        self.live, self._read_is_known = types[HEARD], types[FRAME_DONE]
        self._pairs: StampPairing[Record] = StampPairing(0.016, lambda r: header_stamp(r.data))
        self._held: deque[RecordedFrame] = deque()
        self._early: deque[tuple[Record, Record]] = deque()
        self._read: set[int] = set()
        self._info: Record | None = None
        self._intrinsics: Intrinsics | None = None
        self.unread = self.unreadable = self.info_changes = 0

    @property
    def unpaired(self) -> int:
        """Images that had no partner of their stamp."""
        return self._pairs.unpaired

    def steps(self) -> Iterator[ReplayStep]:
        """Frames and session inputs in their order."""
        for record in self._records:
            if record.type != REPLAY_TOPICS.get(record.topic):
                continue
            try:
                message = self._message(record)
            except (ValueError, BagError):
                self.unreadable += 1
                continue
            if record.topic == INFO:
                yield from self._add_info(record, message)
            elif record.topic in (COLOUR, DEPTH):
                pair = self._pairs.add(int(record.topic == DEPTH), record)
                if pair is not None:
                    yield from self._add_pair(*pair)
            elif record.topic == FRAME_DONE:
                if message.kind == READ:
                    yield from self._add_read(header_stamp(record.data))
            elif message.kind in set(InputKind) and message.kind != InputKind.NOTHING:
                stamp = header_stamp(record.data)
                yield SessionInput(InputKind(message.kind), stamp, message)
        yield from self._release(len(self._held))

    def _message(self, record: Record) -> Any:
        topic = self._recorded.get(record.topic)
        if topic is not None:
            return definitions().read_recorded(topic, record.data)
        return definitions().read(record.data, record.type)

    def _add_info(self, record: Record, message: Any) -> Iterator[RecordedFrame]:
        self._info = record
        self._count_change(message)
        while self._early:
            yield from self._add_pair(*self._early.popleft())

    def _count_change(self, message: Any) -> None:
        try:
            intrinsics = intrinsics_of(message)
        except ValueError:
            return
        self.info_changes += self._intrinsics not in (None, intrinsics)
        self._intrinsics = intrinsics

    def _add_pair(self, colour: Record, depth: Record) -> Iterator[RecordedFrame]:
        if self._info is None:
            self._early.append((colour, depth))
            self.unread += len(self._early) > MAX_HELD_FRAMES
            if len(self._early) > MAX_HELD_FRAMES:
                self._early.popleft()
            return
        frame = RecordedFrame(header_stamp(depth.data), self._info, colour, depth)
        if not self._read_is_known:
            yield frame
            return
        self._held.append(frame)
        whole = frame.stamp in self._read
        yield from self._release(len(self._held) if whole else len(self._held) - MAX_HELD_FRAMES)

    def _add_read(self, stamp: int) -> Iterator[RecordedFrame]:
        self._read.add(stamp)
        stamps = [frame.stamp for frame in self._held]
        if stamp in stamps:
            yield from self._release(stamps.index(stamp) + 1)

    def _release(self, count: int) -> Iterator[RecordedFrame]:
        """Remove the oldest held frames; those that were read are shown."""
        for _ in range(count):
            frame = self._held.popleft()
            if frame.stamp in self._read:
                self._read.discard(frame.stamp)
                yield frame
            else:
                self.unread += 1
