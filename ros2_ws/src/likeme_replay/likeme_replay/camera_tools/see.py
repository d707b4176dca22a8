"""Command `see`: what perception sees, drawn into the pictures."""

from __future__ import annotations

import json
import os
import sys
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from likeme_bags.errors import BagError
from likeme_bags.reading import open_bag
from likeme_core.cli import Domain, Network
from likeme_core.typer_app import App
from likeme_core.world import World, load_world
from likeme_perception.image_pairs import (
    ImagePair,
    check_image_name,
    find_pairs,
    intrinsics_file,
    read_frame,
    read_intrinsics,
    write_frame,
    write_image,
    write_intrinsics,
)
from likeme_perception.observation_report import json_report, text_report
from likeme_perception.rgbd import RgbdFrame
from likeme_replay.camera_tools.drawn_frames import (
    draw_recording,
    draw_single,
    told,
    until,
    write_video,
)
from likeme_replay.camera_tools.frame_source import are_pairs

#: Where pictures go if --out is not given.
OUT = Path('out/see')
VIDEO = '.mp4'

app = App(add_completion=False, rich_markup_mode=None)


@app.command()
def see(
    inputs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar='[BAG | FOLDER | COLOUR DEPTH...]',
            help='A recording, a folder of pairs NAME_color.png and NAME_depth.png, or pairs.',
        ),
    ] = None,
    live: Annotated[bool, typer.Option('--live', help='From a running perception_node.')] = False,
    out: Annotated[
        Path | None, typer.Option(help='PNG or MP4 to write; a folder for several pairs.')
    ] = None,
    at: Annotated[
        float | None, typer.Option(min=0.0, help='Of a BAG: one picture, s after the first.')
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(min=0.1, help='With --live: length of an MP4; default: Ctrl-C.')
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(
            metavar='NAME|FILE',
            help='World with objects, camera and regions; default of a BAG: the recorded one.',
        ),
    ] = None,
    any_table: Annotated[
        bool,
        typer.Option(
            '--any-table',
            help="Find camera pose and table in the image, as for pairs without --world.",
        ),
    ] = False,
    background_color: Annotated[
        Path | None, typer.Option(help='Of pairs: the empty table, to detect hands.')
    ] = None,
    background_depth: Annotated[Path | None, typer.Option(help='Its depth image.')] = None,
    intrinsics: Annotated[
        Path | None,
        typer.Option(help="JSON with fx, fy, cx, cy; default: FOLDER's, or a Kinect's."),
    ] = None,
    save: Annotated[
        Path | None, typer.Option(help='Of a BAG: a folder for the last picture as a pair.')
    ] = None,
    as_json: Annotated[bool, typer.Option('--json', help='Print JSON instead of text.')] = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:  # fmt: skip
    """Draw hands, arms, objects with states and probabilities, and reasons for UNKNOWN."""
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    given = inputs or []
    if live == bool(given):
        _refuse('Expected either --live or images or a recording; see --help.')
    with _error_messages():
        if live:
            _see_live(out or _default('live', '.png'), seconds, domain, network)
        elif are_pairs(given):
            empty = _empty_table(background_color, background_depth)
            camera = intrinsics or intrinsics_file(given)
            known = None if world is None else load_world(world)
            _see_pairs(find_pairs(given), out, camera, known, any_table, empty, as_json)
        else:
            _see_bag(given[0], out, at, world, any_table, save, as_json)


def _empty_table(colour: Path | None, depth: Path | None) -> RgbdFrame | None:
    if (colour is None) != (depth is None):
        raise ValueError('Expected both --background-color and --background-depth, got one.')
    return read_frame(colour, depth) if colour and depth else None


def _see_live(out: Path, seconds: float | None, domain: int, network: bool) -> None:
    _check_name(out)
    # Imported here: pictures and recordings need no ROS.
    from likeme_replay.ros.see_live import see_live
    from likeme_replay.ros.waiting_node import ReplayFailedError

    try:
        print(see_live(out, seconds, domain, network))
    except ReplayFailedError as error:
        raise ValueError(str(error)) from None


def _see_pairs(
    pairs: list[ImagePair],
    out: Path | None,
    camera: Path | None,
    world: World | None,
    any_table: bool,
    empty: RgbdFrame | None,
    as_json: bool,
) -> None:
    """Draw pairs, each by itself."""
    folder = None
    if len(pairs) > 1:
        folder = out or OUT
        folder.mkdir(parents=True, exist_ok=True)
    elif out is not None:
        check_image_name(out)
    reports = {}
    for pair in pairs:
        frame = read_frame(pair.colour, pair.depth)
        intrinsics = read_intrinsics(camera, frame.depth.shape)
        drawn = draw_single(frame, intrinsics, world, not any_table, empty)
        path = folder / f'{pair.name}.png' if folder else out or _default(pair.name, '.png')
        write_image(path, drawn.picture)
        reports[pair.name] = json_report(drawn.table)
        if not as_json:
            print('\n'.join([*([f'{pair.name}:'] if folder else []), text_report(drawn.table)]))
            print(f'Written: {path}')
    if as_json:
        print(json.dumps(reports if folder else reports[pairs[0].name], indent=1))


def _see_bag(
    path: Path,
    out: Path | None,
    at: float | None,
    world: str | None,
    any_table: bool,
    save: Path | None,
    as_json: bool,
) -> None:
    """Draw a recording as a video, or one picture of it."""
    out = out or _default(path.stem, VIDEO if at is None else '.png')
    _check_name(out)
    if save is not None:
        save.mkdir(parents=True, exist_ok=True)
    with open_bag(path) as bag:
        drawn = until(at, told(draw_recording(bag, world, any_table), as_json))
        if out.suffix == VIDEO:
            last = write_video(out, drawn)
        else:
            last = deque(drawn, maxlen=1).pop()
            write_image(out, last.picture)
        for sentence in bag.warnings:
            print(f'see: {sentence}', file=sys.stderr)
    if save is not None:
        write_frame(save, path.stem, last.frame)
        write_intrinsics(save, last.intrinsics)
    if as_json:
        print(json.dumps(json_report(last.table), indent=1))
    else:
        print(f'{text_report(last.table)}\nWritten: {out}')


def _default(name: str, ending: str) -> Path:
    OUT.mkdir(parents=True, exist_ok=True)
    return OUT / f'{name}{ending}'


def _check_name(out: Path) -> None:
    if out.suffix == VIDEO:
        if not out.parent.is_dir() or out.is_dir():
            raise ValueError(f'Expected {out} to be a file in a folder, got no such folder.')
    else:
        check_image_name(out)


@contextmanager
def _error_messages() -> Iterator[None]:
    """Print errors as one sentence, with exit code 1."""
    try:
        yield
    except (ValueError, OSError, BagError) as error:
        print(f'see: {" ".join(str(error).split())}', file=sys.stderr)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        print('see: ended.', file=sys.stderr)
        raise typer.Exit(130) from None


def _refuse(sentence: str) -> NoReturn:
    print(f'see: {sentence}', file=sys.stderr)
    raise typer.Exit(2)


def main() -> None:
    """Entry point of `see`."""
    app()


if __name__ == '__main__':
    main()
