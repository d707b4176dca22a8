"""Checks of RGB-D recordings: that colour, depth and camera info belong together."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from likeme_bags.camera_topics import (
    CAMERA_INFO,
    COLOUR,
    DEPTH,
    camera_remap,
    camera_role,
    without_slash,
)
from likeme_bags.check_results import CheckResult, fail, ok, warn
from likeme_bags.errors import BagError
from likeme_bags.reading import Bag
from likeme_bags.topic_statistics import TopicStatistics

# Largest difference of the header stamps of a pair, ns: half a period of a camera of 30 Hz.
_TOGETHER = 16_666_667
# A recorder discovers one topic after the other, and is stopped between two messages: an image
# without a partner this near, ns, to where the other topic begins or ends is no loss.
_EDGE = 1_000_000_000


def _camera(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    """The three topics perception needs, under the cell's names or ones that are known."""
    if not any(f.is_image for f in statistics):
        return ok('No camera is recorded.')
    try:
        remap = camera_remap(bag)
    except BagError as error:
        return warn(str(error))
    foreign = [
        f'{old}:={new}' for old, new in remap.items() if without_slash(old) != without_slash(new)
    ]
    if foreign:
        return warn(f'Plays to the cell with --remap {" --remap ".join(foreign)}.')
    return ok("Colour, depth and camera info are there under the cell's names.")


def _info(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    """A CameraInfo beside every camera, of the images' size."""
    images = [f for f in statistics if f.is_image and f.stamps]
    infos = [f for f in statistics if f.topic.type == CAMERA_INFO and f.stamps]
    if not images:
        return ok('No camera is recorded.')
    if not infos:
        return _incomplete(
            images, f'Expected a camera_info beside {images[0].topic.name}, got none.'
        )
    sizes = {size for f in infos for size in f.infos}
    for stats in _of_the_camera(bag, images):
        strange = stats.shapes - sizes
        if strange and sizes:
            height, width = next(iter(strange))
            said = ', '.join(f'{h}x{w}' for h, w in sorted(sizes))
            return fail(f'{stats.topic.name} is {height}x{width}, camera_info says {said}.')
    return ok('camera_info is there and has the size of the images.')


def _of_the_camera(bag: Bag, images: Sequence[TopicStatistics]) -> Sequence[TopicStatistics]:
    """Those images that a camera_info speaks of: not overlays that somebody drew."""
    try:
        names = camera_remap(bag)
    except BagError:
        return images
    return [stats for stats in images if stats.topic.name in names]


def _pairs(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    """Every colour image with a depth image of its time, and the other way round."""
    colour, depth = _of(statistics, COLOUR, ('rgb8',)), _of(statistics, DEPTH, ('16UC1', '32FC1'))
    if colour is None and depth is None:
        return ok('No camera is recorded.')
    if colour is None or depth is None:
        lone = [each for each in (colour, depth) if each is not None]
        return _incomplete(
            lone, f'{lone[0].topic.name} is there without its other half, colour or depth.'
        )
    alone = _alone(colour.times, depth.times), _alone(depth.times, colour.times)
    said = (
        f'{len(alone[0])} of {len(colour.stamps)} colour images have no depth, '
        f'{len(alone[1])} of {len(depth.stamps)} depth images no colour'
    )
    if _inside(alone[0], depth.times) or _inside(alone[1], colour.times):
        return fail(f'{said}.')
    if any(map(len, alone)):
        return warn(f'{said}, all of them where the recording begins or ends.')
    return ok(f'{len(colour.stamps)} pairs of colour and depth, none alone.')


def _incomplete(images: Sequence[TopicStatistics], sentence: str) -> CheckResult:
    """A failure for cameras that perception reads; others need no other half."""
    read = any(camera_role(stats.topic.name) for stats in images)
    return (fail if read else warn)(sentence)


def _of(
    statistics: Sequence[TopicStatistics], name: str, encodings: Sequence[str]
) -> TopicStatistics | None:
    """The topic of the cell's name, else the one with most images of such an encoding."""
    images = [f for f in statistics if f.is_image and f.encodings]
    named = [f for f in images if without_slash(f.topic.name) == name]
    there = [f for f in images if f.encodings & set(encodings)]
    return max(named or there, key=lambda f: len(f.stamps), default=None)


def _alone(times: NDArray[np.int64], others: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those of these times that have none of the others near."""
    others = np.sort(others)
    at = np.searchsorted(others, times)
    before = np.abs(times - others[np.clip(at - 1, 0, len(others) - 1)])
    after = np.abs(times - others[np.clip(at, 0, len(others) - 1)])
    alone: NDArray[np.int64] = times[np.minimum(before, after) > _TOGETHER]
    return alone


def _inside(alone: NDArray[np.int64], others: NDArray[np.int64]) -> bool:
    """Whether some of these lie where the others are, or go on long without them."""
    begin, end = others.min(), others.max()
    outside = ((alone < begin) & (alone > begin - _EDGE)) | ((alone > end) & (alone < end + _EDGE))
    return not outside.all()


def _pictures(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    """One size and encoding a topic."""
    images = [f for f in statistics if f.is_image and f.shapes]
    for stats in images:
        if len(stats.shapes) > 1 or len(stats.encodings) > 1:
            seen = [f'{h}x{w}' for h, w in sorted(stats.shapes)] + sorted(stats.encodings)
            return fail(f'{stats.topic.name} changes its size or encoding: {", ".join(seen)}.')
    if not images:
        return ok('No camera is recorded.')
    return ok('Images keep their size and encoding.')


CAMERA_CHECKS: dict[str, Callable[[Bag, Sequence[TopicStatistics]], CheckResult]] = {
    'camera topics': _camera,
    'camera info': _info,
    'rgb-d pairs': _pairs,
    'pictures': _pictures,
}
