"""What one pass over a bag tells of each topic: the material of `bag.sh info` and `doctor`."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from likeme_bags.adapting import CAMERA_INFO
from likeme_bags.errors import BagError
from likeme_bags.headers import has_header, header_stamp
from likeme_bags.images import COMPRESSED, IMAGE, decode_image
from likeme_bags.reading import Bag
from likeme_bags.typestores import decode
from likeme_bags.values import Record, Topic

# Messages of a topic that are decoded in full, spread evenly.
_SAMPLES = 25


@dataclass(eq=False)
class TopicFacts:
    """One topic. Stamps are in ns and in the order of log times."""

    topic: Topic
    stamps: array[int] = field(default_factory=lambda: array('q'))
    headers: array[int] = field(default_factory=lambda: array('q'))
    size: int = 0
    # Messages equal to the one before in time and content.
    repeated: int = 0
    # What did not decode, and sizes and encodings of pictures seen.
    errors: list[str] = field(default_factory=list)
    shapes: set[tuple[int, int]] = field(default_factory=set)
    encodings: set[str] = field(default_factory=set)
    infos: set[tuple[int, int]] = field(default_factory=set)

    @property
    def log_times(self) -> NDArray[np.int64]:
        """Log times, shape (n,)."""
        return np.array(self.stamps, np.int64)

    @property
    def header_times(self) -> NDArray[np.int64]:
        """Header stamps, shape (n,), or (0,) where the type has no header."""
        return np.array(self.headers, np.int64)

    @property
    def times(self) -> NDArray[np.int64]:
        """Header stamps where there are some, else log times."""
        return self.header_times if self.headers else self.log_times

    @property
    def is_camera(self) -> bool:
        """Whether it comes from a camera, one publisher at a steady rate."""
        return self.is_image or self.topic.type == CAMERA_INFO

    @property
    def is_image(self) -> bool:
        """Whether it carries pictures."""
        return self.topic.type in (IMAGE, COMPRESSED)


def gather(bag: Bag) -> list[TopicFacts]:
    """Read the whole bag once."""
    facts = {(t.name, t.type, t.schema): TopicFacts(t) for t in bag.topics}
    with_header = {key for key, fact in facts.items() if has_header(fact.topic)}
    last: dict[tuple[str, str, int], tuple[int, int]] = {}
    for record in bag.records():
        key = record.topic, record.type, record.schema
        fact = facts[key]
        fact.stamps.append(record.stamp)
        fact.size += len(record.data)
        mark = record.stamp, crc32(record.data)
        fact.repeated += last.get(key) == mark
        last[key] = mark
        if key in with_header:
            _note_header(fact, record)
        step = max(fact.topic.count // _SAMPLES, 1)
        if (len(fact.stamps) - 1) % step == 0:
            _note_content(fact, record)
    return list(facts.values())


def _note_header(fact: TopicFacts, record: Record) -> None:
    try:
        fact.headers.append(header_stamp(record.data))
    except BagError as error:
        fact.errors.append(str(error))


def _note_content(fact: TopicFacts, record: Record) -> None:
    """Decode one message and keep what the checks want of it."""
    try:
        if fact.is_image:
            image = decode_image(record)
            fact.shapes.add((image.pixels.shape[0], image.pixels.shape[1]))
            fact.encodings.add(image.encoding)
        elif fact.topic.definition or fact.topic.type.startswith('sensor_msgs/'):
            message = decode(fact.topic, record.data)
            if fact.topic.type == CAMERA_INFO:
                size = getattr(message, 'height', 0), getattr(message, 'width', 0)
                fact.infos.add(size)
    except BagError as error:
        fact.errors.append(str(error))
