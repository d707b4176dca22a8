"""Times, sizes and decoding errors of each topic, gathered for `bag.sh doctor` in one pass."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from likeme_bags.camera_topics import CAMERA_INFO
from likeme_bags.errors import BagError, UnsupportedError
from likeme_bags.headers import has_header, header_stamp
from likeme_bags.images import COMPRESSED, IMAGE, decode_image
from likeme_bags.reading import Bag
from likeme_bags.typestores import decode
from likeme_bags.values import Record, Topic

# Messages of a topic that are decoded in full, spread evenly.
_SAMPLES = 25


@dataclass(eq=False)
class TopicStatistics:
    """One topic. Stamps are in ns and in the order of log times."""

    topic: Topic
    stamps: array[int] = field(default_factory=lambda: array('q'))
    headers: array[int] = field(default_factory=lambda: array('q'))
    size: int = 0
    # Messages equal to the one before in time and content.
    repeated: int = 0
    # What did not decode, and why the topic cannot be decoded at all ('': it can).
    errors: list[str] = field(default_factory=list)
    unsupported: str = ''
    # Sizes (height, width) and encodings of images, and the sizes in CameraInfo.
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
        """Whether it carries images."""
        return self.topic.type in (IMAGE, COMPRESSED)


def topic_statistics(bag: Bag) -> list[TopicStatistics]:
    """Read the whole bag once."""
    statistics = {topic.key: TopicStatistics(topic) for topic in bag.topics}
    with_header = {key for key, stats in statistics.items() if has_header(stats.topic)}
    last: dict[object, tuple[int, int]] = {}
    for record in bag.records():
        key = record.key
        stats = statistics[key]
        stats.stamps.append(record.stamp)
        stats.size += len(record.data)
        mark = record.stamp, crc32(record.data)
        stats.repeated += last.get(key) == mark
        last[key] = mark
        if key in with_header:
            _note_header(stats, record)
        step = max(stats.topic.count // _SAMPLES, 1)
        if (len(stats.stamps) - 1) % step == 0:
            _note_content(stats, record)
    return list(statistics.values())


def _note_header(stats: TopicStatistics, record: Record) -> None:
    try:
        stats.headers.append(header_stamp(record.data))
    except BagError as error:
        stats.errors.append(f'{record.topic}: {error}')


def _note_content(stats: TopicStatistics, record: Record) -> None:
    """Decode one message and keep what the checks need of it."""
    try:
        if stats.is_image:
            image = decode_image(record)
            stats.shapes.add((image.pixels.shape[0], image.pixels.shape[1]))
            stats.encodings.add(image.encoding)
        elif stats.topic.definition or stats.topic.type.startswith('sensor_msgs/'):
            message = decode(stats.topic, record.data)
            if stats.topic.type == CAMERA_INFO:
                size = getattr(message, 'height', 0), getattr(message, 'width', 0)
                stats.infos.add(size)
    except UnsupportedError as error:
        stats.unsupported = str(error)
    except BagError as error:
        stats.errors.append(str(error))
