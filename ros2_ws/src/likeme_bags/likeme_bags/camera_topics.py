"""The colour, depth and camera_info topics of one camera, by the names that drivers give them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Any, NamedTuple

from likeme_bags.errors import BagError
from likeme_bags.images import COMPRESSED, IMAGE, decode_image
from likeme_bags.reading import Bag
from likeme_bags.typestores import decode
from likeme_bags.values import Topic

CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'
COLOUR = 'camera/rgb/image_rect_color'
INFO = 'camera/rgb/camera_info'
DEPTH = 'camera/depth_registered/image_rect'


class CameraNames(NamedTuple):
    """Names of registered streams, best first, without namespace and transport."""

    colour: tuple[str, ...]
    depth: tuple[str, ...]
    info: tuple[str, ...]


_RGB = ('rgb/image_rect_color', 'rgb/image_color', 'rgb/image_raw', 'rgb/image_rect')
_COLOR = ('color/image_rect', 'color/image_rect_color', 'color/image_raw', 'color/image_rect_raw')
_REGISTERED = tuple(
    f'depth_registered/{name}'
    for name in (
        'image_rect', 'image_raw', 'hw_registered/image_rect', 'hw_registered/image_rect_raw',
        'sw_registered/image_rect', 'sw_registered/image_rect_raw', 'image_rect_raw', 'image',
    )
)  # fmt: skip
_UNREGISTERED = ('depth/image_rect', 'depth/image', 'depth/image_raw')
#: Sets of streams that belong together, best first. Where the depth's name does not say that it
#: is registered to colour, the sizes have to tell.
CAMERAS = (
    # OpenNI, OpenNI 2, Astra, and the cell.
    CameraNames(_RGB, _REGISTERED, ('rgb/camera_info', 'depth_registered/camera_info')),
    # RealSense; the namespace is camera, camera/camera or the user's.
    CameraNames(
        _COLOR,
        ('aligned_depth_to_color/image_raw',),
        ('color/camera_info', 'aligned_depth_to_color/camera_info'),
    ),
    # Kinect v2 (iai_kinect2).
    *(
        CameraNames((f'{size}/image_color_rect',), (f'{size}/image_depth_rect',),
                    (f'{size}/camera_info',))
        for size in ('qhd', 'sd', 'hd')
    ),
    # Azure Kinect: in the colour camera's image, or in the depth camera's.
    CameraNames(
        _RGB, ('depth_to_rgb/image_raw',), ('rgb/camera_info', 'depth_to_rgb/camera_info')
    ),
    CameraNames(
        ('rgb_to_depth/image_raw',),
        ('depth/image_raw',),
        ('depth/camera_info', 'rgb_to_depth/camera_info'),
    ),
    # ZED.
    CameraNames(
        (
            'rgb/image_rect_color', 'rgb/color/rect/image',
            'left/image_rect_color', 'left/color/rect/image',
        ),
        ('depth/depth_registered',),
        (
            'rgb/camera_info', 'rgb/color/rect/camera_info',
            'left/camera_info', 'left/color/rect/camera_info', 'depth/camera_info',
        ),
    ),
    # OAK (depthai_ros_driver, depthai_examples): stereo depth is aligned to colour.
    CameraNames(
        ('rgb/image_rect', 'rgb/image_raw'),
        ('stereo/image_raw', 'stereo/image_rect', 'stereo/depth'),
        ('rgb/camera_info', 'stereo/camera_info'),
    ),
    CameraNames(
        ('color/video/image', 'color/image', 'color/preview/image'),
        ('stereo/depth', 'stereo/image_raw'),
        ('color/video/camera_info', 'color/camera_info', 'stereo/camera_info'),
    ),
    # Orbbec, and others of the same names.
    CameraNames(
        (*_COLOR, *_RGB),
        (*_REGISTERED, *_UNREGISTERED),
        ('color/camera_info', 'rgb/camera_info', 'depth_registered/camera_info',
         'depth/camera_info'),
    ),
    # Gazebo, Gazebo Classic, Isaac Sim.
    CameraNames(('image',), ('depth_image',), ('camera_info',)),
    CameraNames(('image_raw',), ('depth/image_raw',), ('camera_info',)),
    CameraNames(('rgb',), ('depth',), ('camera_info',)),
)  # fmt: skip
_NAMESPACES = ('', 'camera/', 'camera/camera/', 'kinect2/')
_TRANSPORTS = ('', '/compressed', '/compressedDepth')
_TYPES = {COLOUR: (IMAGE, COMPRESSED), DEPTH: (IMAGE, COMPRESSED), INFO: (CAMERA_INFO,)}


def without_slash(name: str) -> str:
    """A topic's name without its leading slash."""
    return name.removeprefix('/')


def camera_role(name: str) -> str:
    """COLOUR, DEPTH or INFO for a topic with a usual name and namespace, else ''."""
    name = without_slash(name).removesuffix('/compressed').removesuffix('/compressedDepth')
    for camera in CAMERAS:
        for role, known in zip(_TYPES, camera, strict=True):
            if any(name == space + each for space in _NAMESPACES for each in known if '/' in each):
                return role
    return ''


def camera_remap(bag: Bag, given: Mapping[str, str] | None = None) -> dict[str, str]:
    """Names in the bag to the three of the cell's camera; `given` names go before known ones.

    The three are of one camera and, where there is a choice, of one size.

    Raises:
        BagError: one of the three is not there, or of a type that cannot be used.
    """
    remap = dict(given or {})
    fixed = {
        without_slash(new): _given_topic(bag, name, without_slash(new))
        for name, new in remap.items()
        if without_slash(new) in _TYPES
    }
    matches = _matches(bag, fixed)
    candidates = [
        topics
        for match in matches
        for topics in product(
            *(
                [fixed[role]] if role in fixed else [t for t in match[role] if t.type in kinds]
                for role, kinds in _TYPES.items()
            )
        )
    ]
    if not candidates:
        raise _missing(bag, fixed, matches)
    for role, topic in zip(_TYPES, _of_one_size(bag, candidates), strict=True):
        if role not in fixed:
            remap[topic.name] = role
    return remap


def _given_topic(bag: Bag, name: str, role: str) -> Topic:
    topics = [t for t in bag.topics if t.count and without_slash(t.name) == without_slash(name)]
    wanted = ' or '.join(_TYPES[role])
    if not topics:
        raise BagError(f'Expected {name} of {wanted}, got {_held(bag)}; see --remap.')
    usable = [topic for topic in topics if topic.type in _TYPES[role]]
    if not usable:
        raise BagError(f'{name} as {role}: expected {wanted}, got {topics[0].type}.')
    return usable[0]


def _matches(bag: Bag, fixed: Mapping[str, Topic]) -> list[dict[str, list[Topic]]]:
    """Topics by role, for each camera and namespace: those with most of the given topics first."""
    there = [(without_slash(topic.name), topic) for topic in bag.topics if topic.count]
    matches = []
    for camera in CAMERAS:
        known = {
            role: [f'{name}{end}' for name in names for end in _TRANSPORTS]
            for role, names in zip(_TYPES, camera, strict=True)
        }
        spaces = dict.fromkeys(
            name.removesuffix(each)
            for name, _ in there
            for names in known.values()
            for each in names
            if f'/{name}'.endswith(f'/{each}')
        )
        # The cell's own namespace first.
        for space in sorted(spaces, key=lambda space: space != 'camera/'):
            matches.append(
                {
                    role: [t for each in names for name, t in there if name == space + each]
                    for role, names in known.items()
                }
            )
    return sorted(
        matches, key=lambda match: -sum(topic in match[role] for role, topic in fixed.items())
    )


def _of_one_size(bag: Bag, candidates: list[tuple[Topic, ...]]) -> tuple[Topic, ...]:
    """The first candidate whose three sizes agree; the first of all if none does."""
    if len(candidates) == 1:
        return candidates[0]
    sizes: dict[str, tuple[int, int] | None] = {}
    for topics in candidates:
        for topic in topics:
            if topic.name not in sizes:
                sizes[topic.name] = _size(bag, topic)
        if len({sizes[topic.name] for topic in topics} - {None}) <= 1:
            return topics
    return candidates[0]


def _size(bag: Bag, topic: Topic) -> tuple[int, int] | None:
    """Rows and columns of a topic's first message; None when it cannot be read."""
    record = next((r for r in bag.records([topic.name]) if r.type == topic.type), None)
    if record is None:
        return None
    try:
        if topic.type == COMPRESSED:
            rows, columns = decode_image(record).pixels.shape[:2]
            return rows, columns
        message: Any = decode(topic, record.data)
    except BagError:
        return None
    return int(message.height), int(message.width)


def _missing(
    bag: Bag, fixed: Mapping[str, Topic], matches: list[dict[str, list[Topic]]]
) -> BagError:
    """What the most complete camera lacks."""
    best = max(matches, key=lambda match: sum(map(bool, match.values())), default={})
    for role, kinds in _TYPES.items():
        wanted, topics = ' or '.join(kinds), best.get(role, [])
        if role in fixed or any(topic.type in kinds for topic in topics):
            continue
        if topics:
            return BagError(
                f'{topics[0].name} as {role}: expected {wanted}, got {topics[0].type}.'
            )
        return BagError(f'Expected {role} of {wanted}, got {_held(bag)}; see --remap.')
    return BagError(f'Expected colour, depth and camera_info of one camera, got {_held(bag)}.')


def _held(bag: Bag) -> str:
    return ', '.join(f'{t.name} ({t.type})' for t in bag.topics) or 'no topics'
