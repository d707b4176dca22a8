"""The topics of a bag across its files: one stream for every channel of every file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Qos

from likeme_bags.bag_warnings import About, Notes
from likeme_bags.errors import BagError, DamagedError
from likeme_bags.limits import MAX_TOPICS
from likeme_bags.metadata import Metadata, TopicClaim
from likeme_bags.qos import LATCHED, profiles
from likeme_bags.ros1_types import ros1_type
from likeme_bags.rosbag2_compression import unpack_message
from likeme_bags.storage import Channel, Storage
from likeme_bags.typestores import full_name
from likeme_bags.values import Record, Topic

# Encapsulations of CDR and XCDR2: the second byte of a message.
_ENCAPSULATIONS = range(12)


@dataclass(frozen=True)
class Stream:
    """The messages of one channel of one file."""

    topic: Topic
    storage: Storage
    # Number of the file in the bag.
    file: int
    channel: int
    # Log times, ns, and rows of the storage's index, in the order of the index; shape (n,).
    stamps: NDArray[np.int64]
    places: NDArray[np.int64]
    blocks: NDArray[np.int32]
    offsets: NDArray[np.int64]
    # From stored bytes to CDR.
    decode: Callable[[bytes], bytes]

    def record(self, place: int, notes: Notes) -> Record | None:
        """The record in a row of the index; None, with a note, when it cannot be passed on."""
        row = int(np.searchsorted(self.places, place))
        stamp = int(self.stamps[row])
        block, offset = int(self.blocks[row]), int(self.offsets[row])
        stored = self.storage.fetch(stamp, self.channel, block, offset)
        if stored is None:
            return None
        try:
            data = self.decode(stored)
            if len(data) < 4 or data[0] != 0 or data[1] not in _ENCAPSULATIONS:
                raise DamagedError(f'Expected CDR, got {data[:4]!r}.')
        except BagError as error:
            notes.loss(About.TOPICS, f'{self.topic.name}: messages not passed on: {error}')
            return None
        return Record(self.topic.name, self.topic.type, stamp, data)


def streams_of(
    storages: Sequence[Storage], metadata: Metadata | None, notes: Notes
) -> list[Stream]:
    """All streams of a bag that can be passed on; what cannot is noted with its topic.

    Raises:
        BagError: there are messages, and none of them can be used.
    """
    claims = {claim.name: claim for claim in metadata.topics} if metadata else {}
    packed = metadata is not None and metadata.compression == 'message'
    streams: list[Stream] = []
    total, refusals = 0, []
    for file, storage in enumerate(storages):
        index = storage.index
        stamps, channels = index.stamps, index.channels
        blocks, offsets = index.blocks, index.offsets
        total += len(stamps)
        known = list(storage.channels.items())[:MAX_TOPICS]
        for key, channel in known:
            rows = np.flatnonzero(channels == key)
            try:
                topic, decode = _topic_of(channel, claims.get(channel.topic), packed, notes)
            except DamagedError as error:
                sentence = f'Topic {channel.topic} is not passed on: {error}'
                if len(rows):
                    refusals.append(sentence)
                    notes.loss(About.TOPICS, sentence)
                else:
                    notes.remark(About.TOPICS, sentence)
                continue
            columns = (stamps[rows], rows.astype(np.int64), blocks[rows], offsets[rows])
            streams.append(Stream(topic.counted(len(rows)), storage, file, key, *columns, decode))
        strange = len(stamps) - int(np.isin(channels, [key for key, _ in known]).sum())
        if strange:
            notes.loss(
                About.TOPICS, f'{strange} messages belong to topics that nothing describes.'
            )
    if total and not any(len(s.stamps) for s in streams):
        raise BagError(refusals[0] if refusals else 'Expected topics, got messages without any.')
    _compare(streams, metadata, total, notes)
    return streams


def topics_of(streams: Sequence[Stream]) -> tuple[Topic, ...]:
    """The topics of all streams, sorted by name; those of split files together."""
    merged: dict[tuple[str, str], Topic] = {}
    for stream in streams:
        key = stream.topic.name, stream.topic.type
        known = merged.get(key)
        if known is None:
            merged[key] = stream.topic
        else:
            count = known.count + stream.topic.count
            merged[key] = (known if known.definition else stream.topic).counted(count)
    return tuple(merged[key] for key in sorted(merged))


def _topic_of(
    channel: Channel, claim: TopicClaim | None, packed: bool, notes: Notes
) -> tuple[Topic, Callable[[bytes], bytes]]:
    """A channel as a topic, and what makes CDR of its messages.

    Raises:
        DamagedError: its messages cannot be used.
    """
    if not channel.topic:
        raise DamagedError(f'Expected a topic name, got none (type {channel.type}).')
    if channel.serialization == 'ros1':
        return _ros1_topic(channel, notes)
    for place, said in (('the file', channel.serialization), ('metadata.yaml', claim)):
        said = said.serialization if isinstance(said, TopicClaim) else said
        if said not in ('cdr', '', None):
            raise DamagedError(f"Expected messages serialised as cdr, {place} says '{said}'.")
    name = full_name(channel.type)
    if name != channel.type:
        notes.remark(
            About.TOPICS, f'{channel.topic}: the old type name {channel.type} is read as {name}.'
        )
    topic = Topic(
        channel.topic,
        name,
        0,
        _qos_of(channel, claim, notes),
        channel.definition,
        channel.encoding,
        channel.type_hash or (claim.type_hash if claim else ''),
    )
    return topic, unpack_message if packed else _as_it_is


def _ros1_topic(channel: Channel, notes: Notes) -> tuple[Topic, Callable[[bytes], bytes]]:
    """As `_topic_of`, of a ROS 1 connection."""
    source = ros1_type(channel.type, channel.definition)
    if source.migrated:
        notes.remark(
            About.TOPICS,
            f'{channel.topic}: ROS 2 lays {source.name} out differently; its fields were '
            'carried over by name.',
        )
    qos = (LATCHED,) if channel.qos == 'latched' else ()
    text, digest = source.definition, source.type_hash
    return Topic(channel.topic, source.name, 0, qos, text, 'ros2msg', digest), source.cdr


def _as_it_is(data: bytes) -> bytes:
    return data


def _qos_of(channel: Channel, claim: TopicClaim | None, notes: Notes) -> tuple[Qos, ...]:
    """Offered profiles: metadata.yaml's before the file's, as `ros2 bag play` has it."""
    found: list[tuple[Qos, ...]] = []
    for written in (claim.qos if claim else '', channel.qos):
        try:
            found.append(profiles(written))
        except DamagedError as error:
            notes.remark(About.QOS, f'{channel.topic}: {error}')
            found.append(())
    if found[0] and found[1] and found[0] != found[1]:
        notes.remark(
            About.QOS,
            f'{channel.topic}: metadata.yaml and the file give different QoS; the former is used.',
        )
    return found[0] or found[1]


def _compare(
    streams: Sequence[Stream], metadata: Metadata | None, total: int, notes: Notes
) -> None:
    """Compare what was found with what metadata.yaml promises."""
    if metadata is None:
        return
    if total != metadata.message_count:
        tell = notes.loss if total < metadata.message_count else notes.remark
        tell(
            About.METADATA, f'{total} messages found, metadata.yaml says {metadata.message_count}.'
        )
    counts: Mapping[str, int] = {t.name: t.count for t in topics_of(streams)}
    for claim in metadata.topics:
        found = counts.get(claim.name, 0)
        if found < claim.count and total >= metadata.message_count:
            notes.loss(
                About.METADATA,
                f'{claim.name}: {found} messages found, metadata.yaml says {claim.count}.',
            )
