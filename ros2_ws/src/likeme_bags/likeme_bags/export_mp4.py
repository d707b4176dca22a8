"""`bag.sh export --format mp4`: one video a camera topic, at a steady rate."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from likeme_bags.errors import BagError
from likeme_bags.images import COMPRESSED, IMAGE, decode_image
from likeme_bags.reading import Bag
from likeme_bags.sampling import held, moments, rate_of
from likeme_bags.videos import Video, as_rgb


def export_mp4(
    bag: Bag, folder: Path, topics: Collection[str] | None = None, fps: float | None = None
) -> list[Path]:
    """Write `folder`/TOPIC.mp4 for every topic of pictures.

    fps: pictures a second; None: the topic's own rate. Where pictures are missing, the last one
    stands still, so that the video lasts as long as the recording.

    Raises:
        BagError: there are no pictures, or one cannot be decoded.
    """
    written = []
    for topic in bag.topics:
        if topic.type not in (IMAGE, COMPRESSED) or not topic.count:
            continue
        if topics is not None and topic.name not in topics:
            continue
        stamps = bag.stamps(topic.name)
        rate = fps or rate_of(stamps) or 1.0
        count = max(round((stamps[-1] - stamps[0]) / 1e9 * rate), 0) + 1
        path = folder / f'{topic.file_stem}.mp4'
        with Video(path, rate) as video:
            for now in held(bag, [topic.name], moments(stamps[0], count, rate)):
                video.write(as_rgb(decode_image(now[topic.name])))
        written.append(path)
    if not written:
        have = ', '.join(f'{t.name} ({t.type})' for t in bag.topics)
        raise BagError(f'Expected a topic of pictures, got {have or "no topics"}.')
    return written
