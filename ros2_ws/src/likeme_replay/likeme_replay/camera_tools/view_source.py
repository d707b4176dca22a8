"""Views of an object: of a running camera, a recording, or pairs of images."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from likeme_bags.reading import open_bag
from likeme_core.world import World
from likeme_perception.config import world_config
from likeme_perception.image_pairs import find_pairs
from likeme_perception.teaching import View, ViewCollector, view_of_pair
from likeme_replay.camera_tools.frame_source import are_pairs, stored_frames
from likeme_replay.camera_tools.recorded_frames import recorded_frames


class ViewSource(NamedTuple):
    """What a command line says of where views come from; intrinsics, any_table: of pairs."""

    inputs: list[Path]
    live: bool
    views: int
    intrinsics: Path | None
    any_table: bool
    domain: int
    network: bool


def views_of(source: ViewSource, world: World) -> Iterator[View]:
    """The views of the object, each announced.

    Raises:
        BagError: a recording cannot be read.
        ValueError: a view shows nothing that can be learned, or the camera sends nothing.
    """
    if source.live:
        yield from _live_views(source, world)
    elif are_pairs(source.inputs):
        pairs = find_pairs(source.inputs)
        taken = stored_frames(source.inputs, len(pairs), source.intrinsics)
        config = None if source.any_table else world_config(world)
        for pair, frame in zip(pairs, taken.frames, strict=True):
            try:
                view = view_of_pair(frame, taken.intrinsics, config, world.table.colour)
            except ValueError as error:
                raise ValueError(f'{pair.name}: {error}') from None
            yield _announced(view, pair.name)
    else:
        yield from _views_of_bag(source.inputs[0], world)


def _views_of_bag(path: Path, world: World) -> Iterator[View]:
    collector: ViewCollector | None = None
    with open_bag(path) as bag:
        for frame, camera in recorded_frames(bag):
            if collector is None:
                collector = ViewCollector(world_config(world), camera, world.table.colour)
            if collector.add(frame):
                yield _announced(collector.views[-1], f'view {len(collector.views)}')


def _live_views(source: ViewSource, world: World) -> Iterator[View]:
    """Views of a running camera: a person turns the object between them."""
    # Imported here: the rest needs no ROS.
    from likeme_replay.ros.live_frames import live_frames
    from likeme_replay.ros.waiting_node import ReplayFailedError

    said = ''
    try:
        with live_frames(source.domain, source.network, keep=2) as camera:
            _, intrinsics = camera.take(1)
            collector = ViewCollector(world_config(world), intrinsics, world.table.colour)
            print(f'Lay the object alone on the table, hands away; {source.views} views.')
            while len(collector.views) < source.views:
                if collector.add(camera.take(1)[0][0]):
                    count = len(collector.views)
                    yield _announced(collector.views[-1], f'view {count} of {source.views}')
                elif collector.waits_for not in (said, 'the object to rest'):
                    said = collector.waits_for
                    print(f'Waiting for {said}.', flush=True)
    except ReplayFailedError as error:
        raise ValueError(str(error)) from None


def _announced(view: View, name: str) -> View:
    shape = view.sample.shape
    print(
        f'{name}: {100 * shape.length:.1f} x {100 * shape.width:.1f} cm, '
        f'{100 * shape.height:.1f} cm high, {len(view.sample.colours)} pixels',
        flush=True,
    )
    return view
