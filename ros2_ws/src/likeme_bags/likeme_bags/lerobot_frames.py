"""One bag as an episode: pictures and joint positions at a steady rate."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_bags.adapting import COLOUR, DEPTH, KNOWN_NAMES, bare
from likeme_bags.errors import BagError
from likeme_bags.images import COMPRESSED, IMAGE, decode_image
from likeme_bags.reading import Bag
from likeme_bags.sampling import held, moments
from likeme_bags.typestores import decode
from likeme_bags.values import Record, Topic
from likeme_bags.videos import as_rgb

JOINTS = 'sensor_msgs/msg/JointState'


class Frame(NamedTuple):
    """One moment: pictures by camera, (H, W, 3) uint8, and joint positions, rad or m, (J,)."""

    pictures: dict[str, NDArray[np.uint8]]
    joints: NDArray[np.float32]


class Episode(NamedTuple):
    """What of a bag becomes an episode."""

    bag: Bag
    # Camera topics by the name they get in the dataset.
    cameras: dict[str, str]
    joint_topic: Topic | None
    joint_names: tuple[str, ...]
    # Log times of the frames, ns.
    moments: NDArray[np.int64]


def episode(bag: Bag, fps: int) -> Episode:
    """Find cameras and joints in a bag; frames run while all of them are there.

    Raises:
        BagError: no camera, or none of its pictures lies beside joint positions.
    """
    cameras: dict[str, str] = {}
    for t in bag.topics:
        if t.type in (IMAGE, COMPRESSED) and t.count and 'overlay' not in t.name:
            cameras[_camera_name(t.name, cameras)] = t.name
    if not cameras:
        have = ', '.join(t.name for t in bag.topics) or 'no topics'
        raise BagError(f'Expected a camera in {bag.path.name}, got {have}.')
    joint_topic = next((t for t in bag.topics if t.type == JOINTS and t.count), None)
    names: tuple[str, ...] = ()
    needed = list(cameras.values())
    if joint_topic is not None:
        needed.append(joint_topic.name)
        first = next(bag.records([joint_topic.name]))
        names = tuple(getattr(decode(joint_topic, first.data), 'name', ()))
    stamps = [bag.stamps(name) for name in needed]
    begin, end = max(int(s[0]) for s in stamps), min(int(s[-1]) for s in stamps)
    if end <= begin:
        raise BagError(f'Expected {", ".join(needed)} at the same time, got one after the other.')
    count = int((end - begin) / 1e9 * fps) + 1
    return Episode(bag, cameras, joint_topic, names, moments(begin, count, fps))


def frames(source: Episode) -> Iterator[Frame]:
    """The episode's frames, in order."""
    topics = list(source.cameras.values())
    if source.joint_topic is not None:
        topics.append(source.joint_topic.name)
    for now in held(source.bag, topics, source.moments):
        pictures = {
            name: as_rgb(decode_image(now[topic])) for name, topic in source.cameras.items()
        }
        joints = np.zeros(0, np.float32)
        if source.joint_topic is not None:
            joints = _positions(source, source.joint_topic, now[source.joint_topic.name])
        yield Frame(pictures, joints)


def _positions(source: Episode, topic: Topic, record: Record) -> NDArray[np.float32]:
    message: Any = decode(topic, record.data)
    by_name = dict(zip(message.name, message.position, strict=False))
    if missing := [name for name in source.joint_names if name not in by_name]:
        raise BagError(
            f'{topic.name}: expected a position of {missing[0]}, got {sorted(by_name)}.'
        )
    return np.array([by_name[name] for name in source.joint_names], np.float32)


def _camera_name(topic: str, taken: Collection[str]) -> str:
    """`color` and `depth` for the first cameras with a known name, else the topic's own name."""
    name = bare(topic).removesuffix('/compressed').removesuffix('/compressedDepth')
    for short, target in (('color', COLOUR), ('depth', DEPTH)):
        if name in KNOWN_NAMES[target] and short not in taken:
            return short
    return bare(topic).replace('/', '_')
