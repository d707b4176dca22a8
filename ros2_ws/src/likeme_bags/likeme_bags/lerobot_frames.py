"""One bag as an episode: images and joint positions at a steady rate."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_bags.camera_topics import COLOUR, DEPTH, camera_role
from likeme_bags.errors import BagError
from likeme_bags.images import COMPRESSED, IMAGE, decode_image
from likeme_bags.reading import Bag
from likeme_bags.sampling import jump_remark, sample_and_hold, sample_times, time_jumps
from likeme_bags.topic_names import distinct, file_stem, rename_remarks, topics_to_export
from likeme_bags.typestores import decode
from likeme_bags.values import Record, Topic
from likeme_bags.videos import as_rgb

JOINTS = 'sensor_msgs/msg/JointState'


class EpisodeFrame(NamedTuple):
    """One time step: images by camera, (H, W, 3) uint8, and joint positions, rad or m, (J,)."""

    images: dict[str, NDArray[np.uint8]]
    joints: NDArray[np.float32]


class EpisodeSource(NamedTuple):
    """What of a bag becomes an episode."""

    bag: Bag
    # Camera topics by the name they get in the dataset.
    cameras: dict[str, str]
    joint_topic: Topic | None
    joint_names: tuple[str, ...]
    # Log times of the frames, ns.
    times: NDArray[np.int64]
    # What a user should know: topics and times that are left out.
    remarks: list[str]


def episode_source(bag: Bag, fps: int, topics: Collection[str] | None = None) -> EpisodeSource:
    """Find cameras and joints in a bag; frames run while all of them are there.

    topics: only these; else all but images whose topic is called an overlay.

    Raises:
        BagError: no camera, or none of its images lies beside joint positions.
    """
    chosen = topics_to_export(bag, topics, (IMAGE, COMPRESSED, JOINTS))
    images = [t.name for t in chosen if t.type != JOINTS and (topics or 'overlay' not in t.name)]
    if not images:
        have = ', '.join(t.name for t in bag.topics) or 'no topics'
        raise BagError(f'Expected a camera in {bag.path.name}, got {have}.')
    cameras = dict(zip(_camera_names(images), images, strict=True))
    joint_topic, names, remarks = _joints(bag, [t for t in chosen if t.type == JOINTS])
    needed = [*images, *([joint_topic.name] if joint_topic else [])]
    stamps = [bag.stamps(name) for name in needed]
    begin, end = max(int(s[0]) for s in stamps), min(int(s[-1]) for s in stamps)
    jumps = [time_jumps(each) for each in stamps]
    remarks += rename_remarks({topic: name for name, topic in cameras.items()}, '_')
    for name, each in zip(needed, jumps, strict=True):
        remarks += jump_remark(name, each)
    times = sample_times(begin, end, fps, np.concatenate(jumps))
    if end <= begin or not len(times):
        raise BagError(f'Expected {", ".join(needed)} at the same time, got one after the other.')
    return EpisodeSource(bag, cameras, joint_topic, names, times, remarks)


def _joints(bag: Bag, topics: Sequence[Topic]) -> tuple[Topic | None, tuple[str, ...], list[str]]:
    """The topic and names of the joints, and what a user should know."""
    if not topics:
        return None, (), []
    topic, *others = topics
    remarks = [f'{other.name} is left out: {topic.name} gives the joints.' for other in others]
    message: Any = decode(topic, next(bag.records([topic.name])).data)
    if len(set(message.name)) < len(message.name):
        raise BagError(f'{topic.name}: expected each joint once, got {list(message.name)}.')
    if not message.name:
        return None, (), [*remarks, f'{topic.name} is left out: it names no joints.']
    return topic, tuple(message.name), remarks


def frames(source: EpisodeSource) -> Iterator[EpisodeFrame]:
    """The episode's frames, in order."""
    topics = list(source.cameras.values())
    if source.joint_topic is not None:
        topics.append(source.joint_topic.name)
    for now in sample_and_hold(source.bag, topics, source.times):
        images = {name: as_rgb(decode_image(now[topic])) for name, topic in source.cameras.items()}
        joints = np.zeros(0, np.float32)
        if source.joint_topic is not None:
            joints = _positions(source, source.joint_topic, now[source.joint_topic.name])
        yield EpisodeFrame(images, joints)


def _positions(source: EpisodeSource, topic: Topic, record: Record) -> NDArray[np.float32]:
    message: Any = decode(topic, record.data)
    by_name = dict(zip(message.name, message.position, strict=False))
    if missing := [name for name in source.joint_names if name not in by_name]:
        raise BagError(
            f'{topic.name}: expected a position of {missing[0]}, got {sorted(by_name)}.'
        )
    with np.errstate(over='ignore'):
        return np.array([by_name[name] for name in source.joint_names]).astype(np.float32)


def _camera_names(topics: Sequence[str]) -> list[str]:
    """`color` and `depth` for the first cameras with a known name, else the topic's own name."""
    names: list[str] = []
    for topic in topics:
        short = {COLOUR: 'color', DEPTH: 'depth'}.get(camera_role(topic), '')
        names.append(short if short and short not in names else file_stem(topic, '_'))
    return distinct(names, '_')
