"""Bags of other robots as the cell expects them: topics renamed, types and images converted."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace

from likeme_bags.errors import BagError
from likeme_bags.images import COMPRESSED, IMAGE, decode_image, encoding_of, image_record
from likeme_bags.reading import Bag
from likeme_bags.typestores import full_name, jazzy_definition, typestore_of
from likeme_bags.values import Record, Topic

CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'
COLOUR = 'camera/rgb/image_rect_color'
INFO = 'camera/rgb/camera_info'
DEPTH = 'camera/depth_registered/image_rect'
# Names that drivers give the three, best first: registered depth before unregistered, rectified
# before raw. Without the leading slash and the transport's suffix.
KNOWN_NAMES: Mapping[str, tuple[str, ...]] = {
    COLOUR: (
        COLOUR,
        'camera/rgb/image_color',
        'camera/rgb/image_raw',
        'camera/rgb/image_rect',
        'camera/color/image_rect',
        'camera/color/image_raw',
        'kinect2/qhd/image_color_rect',
        'kinect2/sd/image_color_rect',
        'kinect2/hd/image_color_rect',
        'rgb_to_depth/image_raw',
        'rgb/image_raw',
    ),
    DEPTH: (
        DEPTH,
        'camera/depth_registered/image_raw',
        'camera/depth_registered/hw_registered/image_rect',
        'camera/depth_registered/hw_registered/image_rect_raw',
        'camera/depth_registered/image',
        'camera/aligned_depth_to_color/image_raw',
        'kinect2/qhd/image_depth_rect',
        'kinect2/sd/image_depth_rect',
        'kinect2/hd/image_depth_rect',
        'depth_to_rgb/image_raw',
        'camera/depth/image_rect',
        'camera/depth/image',
        'camera/depth/image_raw',
    ),
    INFO: (
        INFO,
        'camera/depth_registered/camera_info',
        'camera/color/camera_info',
        'camera/aligned_depth_to_color/camera_info',
        'kinect2/qhd/camera_info',
        'kinect2/sd/camera_info',
        'kinect2/hd/camera_info',
        'rgb/camera_info',
        'camera/depth/camera_info',
    ),
}
# Raw colour that perception reads; others are converted if they can be.
_COLOUR_ENCODINGS = ('rgb8', 'bgr8', 'rgba8', 'bgra8')
_TRANSPORTS = ('', '/compressed', '/compressedDepth')
_WANTED = {COLOUR: (IMAGE, COMPRESSED), DEPTH: (IMAGE, COMPRESSED), INFO: (CAMERA_INFO,)}


def without_slash(name: str) -> str:
    """A topic's name without its leading slash."""
    return name.removeprefix('/')


def camera_role(name: str) -> str:
    """COLOUR, DEPTH or INFO for a topic that drivers are known to call so, else ''."""
    name = without_slash(name).removesuffix('/compressed').removesuffix('/compressedDepth')
    return next((target for target, known in KNOWN_NAMES.items() if name in known), '')


def camera_remap(bag: Bag, given: Mapping[str, str] | None = None) -> dict[str, str]:
    """Names in the bag to the three of the cell's camera; `given` names go before known ones.

    Raises:
        BagError: one of the three is not there, or of a type that cannot be used.
    """
    remap = dict(given or {})
    for target, known in KNOWN_NAMES.items():
        chosen = [name for name, new in remap.items() if without_slash(new) == target]
        topic = _first(bag, chosen or [f'{n}{end}' for n in known for end in _TRANSPORTS])
        if topic is None:
            have = ', '.join(f'{t.name} ({t.type})' for t in bag.topics) or 'no topics'
            wanted = ' or '.join(_WANTED[target])
            names = ', '.join(chosen) or target
            raise BagError(f'Expected {names} of {wanted}, got {have}; see --remap.')
        if topic.type not in _WANTED[target]:
            wanted = ' or '.join(_WANTED[target])
            raise BagError(f'{topic.name} as {target}: expected {wanted}, got {topic.type}.')
        remap[topic.name] = next(
            (new for new in remap.values() if without_slash(new) == target), target
        )
    return remap


def _first(bag: Bag, names: Collection[str]) -> Topic | None:
    """The first of these topics that has messages."""
    there = {without_slash(topic.name): topic for topic in bag.topics if topic.count}
    return next(
        (there[without_slash(name)] for name in names if without_slash(name) in there), None
    )


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
