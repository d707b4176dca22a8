"""What perception sees in images and recordings, drawn into the pictures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_bags.reading import Bag
from likeme_bags.videos import Video
from likeme_core.world import World
from likeme_perception.catalogue import Catalogue, world_catalogue
from likeme_perception.config import PerceptionConfig, world_config
from likeme_perception.observation import TableObservation
from likeme_perception.overlay import draw
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_perception.single_frame import any_table, look_at
from likeme_replay.camera_tools.recorded_frames import recorded_frames, recorded_settings

# Frames of an unknown table from which its background is learned.
_BACKGROUND_FRAMES = 10
# Frames from whose stamps the rate of a video is taken, and what it may be, Hz.
_RATE_FRAMES, _RATES = 16, (0.1, 240.0)


class DrawnFrame(NamedTuple):
    """A frame and its camera, what was seen in it, and the picture (H, W, 3) that shows it."""

    frame: RgbdFrame
    intrinsics: Intrinsics
    table: TableObservation
    picture: NDArray[np.uint8]


class UnreadFramesError(ValueError):
    """Perception could read no frame: expected and got."""


def draw_single(
    frame: RgbdFrame, camera: Intrinsics, world: World | None, posed: bool, empty: RgbdFrame | None
) -> DrawnFrame:
    """Look at one frame.

    Args:
        frame: with what is on the table.
        camera: of both frames.
        world: whose objects are known; None: none are.
        posed: the camera is where the world says; else pose and table are found in the image.
        empty: the table without anything; needed to find hands without a world's pose.

    Raises:
        ValueError: there is no table where it is expected.
    """
    config = None
    if world is not None and posed:
        config = replace(world_config(world), settle_time=0.0, absence_time=0.0)
    catalogue = None if world is None else world_catalogue(world)
    table, perception = look_at(frame, camera, empty, config, catalogue)
    picture = _picture(frame, table, perception, world if posed else None)
    return DrawnFrame(frame, camera, table, picture)


def draw_recording(bag: Bag, world_name: str | None, any_camera: bool) -> Iterator[DrawnFrame]:
    """Every frame of a bag that perception reads once it has learned the background.

    any_camera: the camera's pose and the table are found in the images.

    Raises:
        UnreadFramesError: there was no such frame.
    """
    settings, world = recorded_settings(bag, world_name)
    config, catalogue = settings.config, settings.catalogue
    if any_camera:
        config = replace(any_table(hands=False), background_frames=_BACKGROUND_FRAMES)
        catalogue = catalogue if world_name else Catalogue(())
    yield from _drawn(bag, config, catalogue, None if any_camera else world)


def _drawn(
    bag: Bag, config: PerceptionConfig, catalogue: Catalogue, world: World | None
) -> Iterator[DrawnFrame]:
    perception: TabletopPerception | None = None
    learned, frames, why = False, 0, ''
    for frame, intrinsics in recorded_frames(bag):
        frames += 1
        if perception is None or perception.intrinsics != intrinsics:
            perception = TabletopPerception(config, intrinsics, catalogue)
        try:
            table = perception.process(frame)
        except ValueError as error:
            why = f' {error}'
            continue
        if table.learned:
            learned = True
            yield DrawnFrame(
                frame, perception.intrinsics, table, _picture(frame, table, perception, world)
            )
    if not learned:
        why = why or f' The background takes {config.background_frames} frames at rest.'
        raise UnreadFramesError(
            f'Expected frames that show a table at rest, got none of {frames} in {bag.path}.{why}'
        )


def _picture(
    frame: RgbdFrame, table: TableObservation, perception: TabletopPerception, world: World | None
) -> NDArray[np.uint8]:
    assert perception.background is not None
    return draw(frame.rgb, table, perception.background.view, world)


def told(drawn: Iterator[DrawnFrame], quiet: bool) -> Iterator[DrawnFrame]:
    """The pictures, while what a hand did and why nothing is known is printed."""
    start, reason = None, ''
    for each in drawn:
        start = each.frame.stamp if start is None else start
        table, time = each.table, f'{(each.frame.stamp - start) * 1e-9:6.2f} s'
        lines = [
            f'{act.object} from {act.x_i.name} to {act.x_f.name} by {act.manner.name.lower()} '
            f'({act.manner_probability:.2f})'
            for act in table.demonstrations
        ]
        lines += [f'an act not understood: {u.reason}' for u in table.unresolved]
        if table.reason != reason:
            reason = table.reason
            lines.append(f'all states are UNKNOWN: {reason}' if reason else 'frames tell again')
        for line in () if quiet else lines:
            print(f'{time}  {line}')
        yield each


def until(at: float | None, drawn: Iterator[DrawnFrame]) -> Iterator[DrawnFrame]:
    """The pictures up to `at` s after the first."""
    start = None
    for each in drawn:
        start = each.frame.stamp if start is None else start
        yield each
        if at is not None and each.frame.stamp - start >= at * 1e9:
            return


def write_video(path: Path, drawn: Iterable[DrawnFrame]) -> DrawnFrame:
    """Write pictures as MP4 at the rate of their stamps; the last one.

    Raises:
        BagError: the file cannot be written.
        ValueError: there are no pictures.
    """
    pictures = iter(drawn)
    first = [each for _, each in zip(range(_RATE_FRAMES), pictures, strict=False)]
    if not first:
        raise ValueError('Expected pictures for a video, got 0.')
    last = first[-1]
    with Video(path, _rate([each.frame.stamp for each in first])) as video:
        for each in first:
            video.write(each.picture)
        for last in pictures:
            video.write(last.picture)
    return last


def _rate(stamps: list[int]) -> float:
    """Frames a second by the median step of stamps (ns)."""
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    return float(np.clip(1e9 / np.median(steps), *_RATES)) if len(steps) else 30.0
