"""Bags of other robots as the cell expects them: topics renamed, types and images converted."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace

from likeme_bags.camera_topics import COLOUR, DEPTH, without_slash
from likeme_bags.errors import BagError
from likeme_bags.images import COMPRESSED, IMAGE, decode_image, encoding_of, image_record
from likeme_bags.reading import Bag
from likeme_bags.typestores import full_name, jazzy_definition, typestore_of
from likeme_bags.values import Record, Topic

# Raw colour that perception reads; others are converted if they can be.
_COLOUR_ENCODINGS = ('rgb8', 'bgr8', 'rgba8', 'bgra8')


@dataclass(frozen=True)
class Adaptation:
    """How to read a bag under other names and types.

    remap: topic in the bag to new name. types: type in the bag to another one of the same layout;
    CompressedImage to Image decompresses. Topics that get the names of the cell's images are
    decompressed, too, and colour is converted to rgb8 where perception cannot read its encoding.
    """

    remap: Mapping[str, str] = field(default_factory=dict)
    types: Mapping[str, str] = field(default_factory=dict)

    def topics(self, bag: Bag) -> tuple[Topic, ...]:
        """The bag's topics under their new names and types.

        Raises:
            BagError: a topic or a type of the maps is not in the bag or does not fit, or two
                topics get one name.
        """
        self._check(bag)
        return tuple(self._topic(topic) for topic in bag.topics)

    def records(
        self,
        bag: Bag,
        topics: Collection[str] | None = None,
        start: int | None = None,
        end: int | None = None,
    ) -> Iterator[Record]:
        """Adapted records; `topics` are the names in the bag.

        Raises:
            BagError: an image cannot be decompressed; with its topic, what was found and expected.
        """
        new = {topic.key: self._topic(topic) for topic in bag.topics}
        self._check(bag)
        for record in bag.records(topics, start, end):
            topic = new[record.key]
            if record.type == COMPRESSED and topic.type == IMAGE:
                yield image_record(topic.name, record.stamp, decode_image(record))
            elif record.type == topic.type == IMAGE and without_slash(topic.name) == COLOUR:
                yield _readable_colour(record)._replace(topic=topic.name)
            else:
                yield record._replace(topic=topic.name, type=topic.type)

    def _new_name(self, name: str) -> str:
        return (
            self.remap.get(name)
            or self.remap.get(without_slash(name))
            or self.remap.get(f'/{without_slash(name)}', name)
        )

    def _new_type(self, topic: Topic) -> str:
        mapped = {full_name(old): full_name(new) for old, new in self.types.items()}
        name = without_slash(self._new_name(topic.name))
        if topic.type == COMPRESSED and name in (COLOUR, DEPTH):
            return mapped.get(topic.type, IMAGE)
        return mapped.get(topic.type, topic.type)

    def _topic(self, topic: Topic) -> Topic:
        name, kind = self._new_name(topic.name), self._new_type(topic)
        if kind == topic.type:
            return replace(topic, name=name)
        text, digest = jazzy_definition(kind)
        if not text:
            text, digest = topic.definition, ''
        return replace(
            topic, name=name, type=kind, definition=text, encoding='ros2msg', type_hash=digest
        )

    def _check(self, bag: Bag) -> None:
        names = {without_slash(topic.name) for topic in bag.topics}
        for old in self.remap:
            if without_slash(old) not in names:
                raise BagError(
                    f'--remap {old}: expected a topic of the bag, got {sorted(names)[:8]}.'
                )
        self._check_names(bag)
        for topic in bag.topics:
            kind = self._new_type(topic)
            if kind != topic.type and (topic.type, kind) != (COMPRESSED, IMAGE):
                _same_layout(topic, kind)

    def _check_names(self, bag: Bag) -> None:
        """Refuse a name that topics would share because one of them was renamed."""
        new = {without_slash(name) for name in self.remap.values()}
        taken: dict[str, str] = {}
        for topic in bag.topics:
            name = without_slash(self._new_name(topic.name))
            if topic.count and name in new and taken.setdefault(name, topic.name) != topic.name:
                raise BagError(
                    f'Expected one topic as {name}, got {taken[name]} and {topic.name}; give one '
                    'another name with --remap.'
                )


def _readable_colour(record: Record) -> Record:
    """The record, as rgb8 where perception cannot read its encoding and this package can."""
    if encoding_of(record) in _COLOUR_ENCODINGS:
        return record
    try:
        image = decode_image(record)
    except BagError:
        return record
    return image_record(record.topic, record.stamp, image) if image.encoding == 'rgb8' else record


def _same_layout(topic: Topic, kind: str) -> None:
    """Refuse a type whose fields differ from those of the topic's own."""
    if not jazzy_definition(kind)[0]:
        # A user's type, not known here: nothing to compare with.
        return
    old = typestore_of(topic).fielddefs[topic.type][1]
    new = typestore_of(Topic(topic.name, kind)).fielddefs[kind][1]
    if [d for _, d in old] != [d for _, d in new]:
        raise BagError(
            f'{topic.name}: expected a type laid out like {topic.type} '
            f'({", ".join(n for n, _ in old)}), got {kind} ({", ".join(n for n, _ in new)}).'
        )
