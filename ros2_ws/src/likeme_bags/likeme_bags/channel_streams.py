"""The topics of a bag across its files: one stream for every channel of every file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from rosbags.interfaces import Qos

from likeme_bags.bag_warnings import BagWarnings, Subject
from likeme_bags.errors import BagError, DamagedError
from likeme_bags.limits import MAX_TOPICS
from likeme_bags.metadata import Metadata, TopicClaim
from likeme_bags.qos import LATCHED, profiles
from likeme_bags.ros1_types import ros1_type
from likeme_bags.rosbag2_compression import decompress_message
from likeme_bags.storage import Channel, Storage
from likeme_bags.typestores import full_name, layout
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
    # From stored bytes to CDR.
    decode: Callable[[bytes], bytes]
    # Nothing says that its messages are compressed, if they are.
    unannounced: bool = False

    def record(self, stamp: int, stored: bytes, log: BagWarnings) -> Record | None:
        """A message as a record; None, with a warning, when it cannot be passed on."""
        try:
            data = self.decode(stored)
            if data is not stored and self.unannounced:
                log.remark(
                    Subject.METADATA,
                    f'{self.topic.name}: messages are compressed one by one, which no '
                    'metadata.yaml says.',
                )
            if len(data) < 4 or data[0] != 0 or data[1] not in _ENCAPSULATIONS:
                raise DamagedError(f'Expected CDR, got {data[:4]!r}.')
        except BagError as error:
            log.loss(Subject.TOPICS, f'{self.topic.name}: messages not passed on: {error}')
            return None
        return Record(self.topic.name, self.topic.type, stamp, data, self.topic.schema)


def streams_of(
    storages: Sequence[Storage], metadata: Metadata | None, log: BagWarnings
) -> list[Stream]:
    """All streams of a bag that can be passed on; what cannot is warned of with its topic.

    Raises:
        BagError: there are messages, and none of them can be used.
    """
    compressed = metadata is not None and metadata.compression == 'message'
    claims = {claim.name: claim for claim in metadata.topics} if metadata else {}
    streams: list[Stream] = []
    total, refusals = 0, []
    for file, storage in enumerate(storages):
        counts = dict(storage.counts)
        total += sum(counts.values())
        for key, channel in list(storage.channels.items())[:MAX_TOPICS]:
            count = counts.pop(key, 0)
            try:
                topic, decode = _topic_of(channel, claims.get(channel.topic), log)
            except DamagedError as error:
                sentence = f'Topic {channel.topic} is not passed on: {error}'
                if count:
                    refusals.append(sentence)
                    log.loss(Subject.TOPICS, sentence)
                else:
                    log.remark(Subject.TOPICS, sentence)
                continue
            unannounced = channel.serialization != 'ros1' and not compressed
            topic = topic.counted(count)
            streams.append(Stream(topic, storage, file, key, decode, unannounced))
        if unknown := sum(counts.values()):
            log.loss(
                Subject.TOPICS, f'{unknown} messages belong to topics that nothing describes.'
            )
    if total and not any(stream.topic.count for stream in streams):
        raise BagError(refusals[0] if refusals else 'Expected topics, got messages without any.')
    streams = _numbered(streams, log)
    _compare(streams, metadata, total, log)
    return streams


def _numbered(streams: Sequence[Stream], log: BagWarnings) -> list[Stream]:
    """The streams, told apart where one type of a topic is defined in several ways."""
    known: dict[tuple[str, str], list[str]] = {}
    result = []
    for stream in streams:
        topic = stream.topic
        layouts = known.setdefault((topic.name, topic.type), [])
        if not (own := layout(topic)):
            # Nobody defines it: it is taken for the same as others of its name.
            result.append(stream)
            continue
        if own not in layouts:
            layouts.append(own)
            if len(layouts) == 2:
                log.remark(
                    Subject.TOPICS,
                    f'{topic.name}: {topic.type} is defined in more than one way; each message '
                    'is read by its own definition.',
                )
        schema = layouts.index(own)
        result.append(replace(stream, topic=replace(topic, schema=schema)) if schema else stream)
    return result


def topics_of(streams: Sequence[Stream]) -> tuple[Topic, ...]:
    """The topics of all streams, sorted by name; those of split files together."""
    merged: dict[tuple[str, str, int], Topic] = {}
    for stream in streams:
        key = stream.topic.key
        known = merged.get(key)
        if known is None:
            merged[key] = stream.topic
        else:
            count = known.count + stream.topic.count
            merged[key] = (known if known.definition else stream.topic).counted(count)
    return tuple(merged[key] for key in sorted(merged))


def _topic_of(
    channel: Channel, claim: TopicClaim | None, log: BagWarnings
) -> tuple[Topic, Callable[[bytes], bytes]]:
    """A channel as a topic, and what makes CDR of its messages.

    Raises:
        DamagedError: its messages cannot be used.
    """
    if not channel.topic:
        raise DamagedError(f'Expected a topic name, got none (type {channel.type}).')
    if channel.serialization == 'ros1':
        return _ros1_topic(channel, log)
    said = {'the file': channel.serialization, 'metadata.yaml': claim and claim.serialization}
    for place, serialization in said.items():
        if serialization not in ('cdr', '', None):
            raise DamagedError(
                f"Expected messages serialised as cdr, {place} says '{serialization}'."
            )
    name = full_name(channel.type)
    if name != channel.type:
        log.remark(
            Subject.TOPICS, f'{channel.topic}: the old type name {channel.type} is read as {name}.'
        )
    topic = Topic(
        channel.topic,
        name,
        0,
        _qos_of(channel, claim, log),
        channel.definition,
        channel.encoding,
        channel.type_hash or (claim.type_hash if claim else ''),
    )
    return topic, decompress_message


def _ros1_topic(channel: Channel, log: BagWarnings) -> tuple[Topic, Callable[[bytes], bytes]]:
    """As `_topic_of`, of a ROS 1 connection."""
    source = ros1_type(channel.type, channel.definition)
    if source.migrated:
        log.remark(
            Subject.TOPICS,
            f'{channel.topic}: ROS 2 lays {source.name} out differently; its fields were '
            'carried over by name.',
        )
    qos = (LATCHED,) if channel.qos == 'latched' else ()
    text, digest = source.definition, source.type_hash
    return Topic(channel.topic, source.name, 0, qos, text, 'ros2msg', digest), source.cdr


def _qos_of(channel: Channel, claim: TopicClaim | None, log: BagWarnings) -> tuple[Qos, ...]:
    """Offered profiles: metadata.yaml's before the file's, as `ros2 bag play` has it."""
    found: list[tuple[Qos, ...]] = []
    for written in (claim.qos if claim else '', channel.qos):
        try:
            found.append(profiles(written))
        except DamagedError as error:
            log.remark(Subject.QOS, f'{channel.topic}: {error}')
            found.append(())
    if found[0] and found[1] and found[0] != found[1]:
        log.remark(
            Subject.QOS,
            f'{channel.topic}: metadata.yaml and the file give different QoS; the former is used.',
        )
    return found[0] or found[1]


def _compare(
    streams: Sequence[Stream], metadata: Metadata | None, total: int, log: BagWarnings
) -> None:
    """Compare what was found with what metadata.yaml promises."""
    if metadata is None:
        return
    if total != metadata.message_count:
        tell = log.loss if total < metadata.message_count else log.remark
        tell(
            Subject.METADATA,
            f'{total} messages found, metadata.yaml says {metadata.message_count}.',
        )
    counts: dict[str, int] = {}
    for stream in streams:
        counts[stream.topic.name] = counts.get(stream.topic.name, 0) + stream.topic.count
    for claim in metadata.topics:
        found = counts.get(claim.name, 0)
        if found < claim.count and total >= metadata.message_count:
            log.loss(
                Subject.METADATA,
                f'{claim.name}: {found} messages found, metadata.yaml says {claim.count}.',
            )
