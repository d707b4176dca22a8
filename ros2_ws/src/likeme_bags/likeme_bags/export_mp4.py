"""`bag.sh export --format mp4`: one video for each image topic, at a steady rate."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import Path

import numpy as np

from likeme_bags.errors import BagError
from likeme_bags.export_result import Exported
from likeme_bags.images import COMPRESSED, IMAGE, decode_image
from likeme_bags.reading import Bag
from likeme_bags.sampling import (
    jump_remark,
    median_rate,
    sample_and_hold,
    sample_times,
    time_jumps,
)
from likeme_bags.topic_names import file_stems, rename_remarks, topics_to_export
from likeme_bags.values import Record, Topic
from likeme_bags.videos import Video, as_rgb

# Of a video whose rate is not given, Hz: bounds, and the rate where all log times are equal.
_RATES = (0.1, 240.0)
_RATE_WITHOUT_TIMES = 30.0


def export_mp4(
    bag: Bag, folder: Path, topics: Collection[str] | None = None, fps: float | None = None
) -> Exported:
    """Write `folder`/TOPIC.mp4 for every topic of images.

    fps: images per second; None: the topic's own rate, within 0.1 and 240. Where images are
    missing, the last one is repeated, so that the video lasts as long as the recording; jumps of
    the clock are left out.

    Raises:
        BagError: there are no images, or one cannot be decoded.
    """
    stems = file_stems(bag.topics)
    chosen = topics_to_export(bag, topics, (IMAGE, COMPRESSED))
    paths, remarks = [], rename_remarks({topic.name: stems[topic] for topic in chosen}, '-')
    for topic in chosen:
        paths.append(folder / f'{stems[topic]}.mp4')
        remarks += _write(bag, topic, paths[-1], fps)
    if not paths:
        have = ', '.join(f'{t.name} ({t.type})' for t in bag.topics)
        raise BagError(f'Expected a topic of images, got {have or "no topics"}.')
    return Exported(paths, remarks, bag.complete)


def _write(bag: Bag, topic: Topic, path: Path, fps: float | None) -> list[str]:
    """One video; what a user should know of it."""
    stamps = bag.stamps(topic.name)
    if len(stamps) > 1 and stamps[0] == stamps[-1]:
        rate = fps or _RATE_WITHOUT_TIMES
        _write_images(path, rate, bag.records([topic.name]))
        return [f'{topic.name}: all log times are equal; images are written at {rate:.5g} Hz.']
    jumps = time_jumps(stamps)
    rate = fps or float(np.clip(median_rate(stamps) or 1.0, *_RATES))
    times = sample_times(int(stamps[0]), int(stamps[-1]), rate, jumps)
    samples = sample_and_hold(bag, [topic.name], times)
    _write_images(path, rate, (sample[topic.name] for sample in samples))
    return jump_remark(topic.name, jumps)


def _write_images(path: Path, rate: float, records: Iterable[Record]) -> None:
    with Video(path, rate) as video:
        for record in records:
            video.write(as_rgb(decode_image(record)))
