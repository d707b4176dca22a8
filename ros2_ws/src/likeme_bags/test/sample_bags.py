"""Small bags of every kind, made from a seed: what tests and the fuzz test damage."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.typesys import Stores, get_typestore

from likeme_bags.images import IMAGE, DecodedImage, image_record
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

STRING = 'std_msgs/msg/String'
# An arbitrary day; the bags' clocks begin here, ns.
BEGIN = 1_700_000_000_000_000_000
PERIOD = 33_333_333
CHATTER, COLOUR, DEPTH = '/chatter', '/camera/rgb/image_rect_color', '/camera/depth/image'
TOPICS = (Topic(CHATTER, STRING), Topic(COLOUR, IMAGE), Topic(DEPTH, IMAGE))


def text_record(topic: str, stamp: int, text: str) -> Record:
    """A std_msgs/String."""
    store = jazzy()
    message = store.types[STRING](text)
    return Record(topic, STRING, stamp, bytes(store.serialize_cdr(message, STRING)))


def sample_records(seed: int, frames: int = 20) -> list[Record]:
    """Text, colour and depth, `frames` of each, all different."""
    rng = np.random.default_rng(seed)
    records = []
    for k in range(frames):
        stamp = BEGIN + k * PERIOD
        colour = rng.integers(0, 256, (12, 16, 3), np.uint8)
        depth = rng.integers(400, 2000, (12, 16), np.uint16)
        records += [
            text_record(CHATTER, stamp, f'{k} {rng.integers(2**40)}' + ' and so on' * 5),
            image_record(COLOUR, stamp + 1, DecodedImage(stamp, 'camera', 'rgb8', colour)),
            image_record(DEPTH, stamp + 2, DecodedImage(stamp, 'camera', '16UC1', depth)),
        ]
    return records


def write_ros2(folder: Path, records: list[Record], storage: str, compress: bool | str) -> Path:
    """A rosbag2 folder; several chunks where the storage has such."""
    with BagWriter(folder, storage, compress) as writer:
        for topic in TOPICS:
            writer.add(topic)
        for k, record in enumerate(records):
            writer.write(record)
            if k % 15 == 14:
                writer.flush()
    return folder


def write_ros1(path: Path, records: list[Record], compression: str) -> Path:
    """A ROS 1 bag of the same messages; compression: 'none', 'bz2' or 'lz4'."""
    store = get_typestore(Stores.ROS1_NOETIC)
    writer = Writer1(path)
    if compression != 'none':
        writer.set_compression(Writer1.CompressionFormat[compression.upper()])
    writer.chunk_threshold = 16_000
    with writer:
        connections = {
            topic.name: writer.add_connection(topic.name, topic.type, typestore=store)
            for topic in TOPICS
        }
        for record in records:
            raw = jazzy().cdr_to_ros1(record.data, record.type)
            writer.write(connections[record.topic], record.stamp, bytes(raw))
    return path


def _mcap(compress: bool | str) -> Callable[[Path, list[Record]], Path]:
    return lambda folder, records: write_ros2(folder / 'sample', records, 'mcap', compress)


def _ros1(compression: str) -> Callable[[Path, list[Record]], Path]:
    return lambda folder, records: write_ros1(folder / 'sample.bag', records, compression)


# What each kind is called, how it is made, and whether checksums cover its messages.
KINDS: dict[str, tuple[Callable[[Path, list[Record]], Path], bool]] = {
    'mcap zstd': (_mcap(True), True),
    'mcap plain': (_mcap(False), True),
    'mcap lz4': (_mcap('lz4'), True),
    'sqlite3': (
        lambda folder, records: write_ros2(folder / 'sample', records, 'sqlite3', False),
        False,
    ),
    'ros1 none': (_ros1('none'), False),
    'ros1 bz2': (_ros1('bz2'), True),
    'ros1 lz4': (_ros1('lz4'), False),
}
