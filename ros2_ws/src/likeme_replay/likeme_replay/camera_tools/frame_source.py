"""Frames for calibration and teaching: of a running camera, a recording or image files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from likeme_bags.reading import open_bag
from likeme_perception.image_pairs import find_pairs, intrinsics_file, read_frame, read_intrinsics
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_replay.camera_tools.recorded_frames import recorded_frames


class CameraFrames(NamedTuple):
    """Frames of one camera."""

    frames: list[RgbdFrame]
    intrinsics: Intrinsics


def are_pairs(inputs: Sequence[Path]) -> bool:
    """Whether inputs are images: two or more files, or a folder of pairs; else a recording."""
    return len(inputs) > 1 or any(inputs[0].glob('*_color.png'))


def stored_frames(
    inputs: Sequence[Path], count: int, intrinsics: Path | None = None
) -> CameraFrames:
    """At most `count` frames of pairs or of a recording, spread over all.

    intrinsics: JSON for pairs; None: that of their folder.

    Raises:
        BagError: it is no recording of a camera.
        ValueError: the images cannot be read, or their camera is not known.
    """
    if are_pairs(inputs):
        return _frames_of_pairs(inputs, count, intrinsics)
    with open_bag(inputs[0]) as bag:
        total = sum(1 for _ in recorded_frames(bag))
        if not total:
            raise ValueError(f'Expected frames that can be decoded in {inputs[0]}, got 0.')
        wanted = set(_spread(total, count))
        taken = [f for number, f in enumerate(recorded_frames(bag)) if number in wanted]
    cameras = {each.intrinsics for each in taken}
    if len(cameras) > 1:
        raise ValueError(f'Expected frames of one camera in {inputs[0]}, got {len(cameras)}.')
    return CameraFrames([each.frame for each in taken], taken[0].intrinsics)


def _frames_of_pairs(inputs: Sequence[Path], count: int, intrinsics: Path | None) -> CameraFrames:
    pairs = find_pairs(inputs)
    path = intrinsics or intrinsics_file(inputs)
    if path is None:
        raise ValueError(
            'Expected the camera in FOLDER/intrinsics.json or --intrinsics, got neither.'
        )
    frames = [read_frame(pairs[k].colour, pairs[k].depth) for k in _spread(len(pairs), count)]
    sizes = {frame.depth.shape for frame in frames}
    if len(sizes) > 1:
        raise ValueError(f'Expected images of one size, got {sorted(sizes)}.')
    return CameraFrames(frames, read_intrinsics(path, frames[0].depth.shape))


def _spread(total: int, count: int) -> list[int]:
    """At most `count` numbers below `total`, evenly spread."""
    wanted = min(total, count)
    return [(2 * k + 1) * total // (2 * wanted) for k in range(wanted)]
