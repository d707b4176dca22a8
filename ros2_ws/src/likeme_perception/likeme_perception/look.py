"""Command `look`: perception on image files, without ROS."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from likeme_core.typer_app import App
from likeme_core.world import World, load_world
from likeme_perception.catalogue import Catalogue, catalogue_entry, object_yaml, world_catalogue
from likeme_perception.config import SIDES, PerceptionConfig, load_config, world_config
from likeme_perception.observation import TableObservation
from likeme_perception.observation_report import json_report, text_report
from likeme_perception.overlay import draw
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres
from likeme_perception.typed_values import json_mapping, number, read_text, require

# Stamps of the repeated frame are this far apart, ns.
_PERIOD = 100_000_000


def read_frame(colour: Path, depth: Path) -> RgbdFrame:
    """A frame from a colour image and a 16-bit depth image in mm."""
    bgr = _image(colour, cv2.IMREAD_COLOR)
    raw = _image(depth, cv2.IMREAD_UNCHANGED)
    if raw.ndim != 2 or raw.dtype != np.uint16:
        raise ValueError(
            f'Expected 16-bit depth of one channel, got {raw.dtype} {raw.shape} in {depth}.'
        )
    rgb = np.ascontiguousarray(bgr[:, :, ::-1], np.uint8)
    return RgbdFrame(0, str(colour), rgb, depth_in_metres(raw))


def _image(path: Path, flags: int) -> NDArray[Any]:
    try:
        image = cv2.imread(str(path), flags)
    except cv2.error:
        # Of a size that OpenCV refuses.
        image = None
    if image is None:
        raise ValueError(f'Expected an image, got {path}.')
    return image


def check_image_name(path: Path) -> None:
    """Refuse a place where no image can be written, before the work.

    Raises:
        ValueError: no such folder, or an ending that stands for no image format.
    """
    if path.is_dir() or not path.parent.is_dir():
        got = 'a folder' if path.is_dir() else f'no folder {path.parent}'
        raise ValueError(f'Expected {path} to be a file in a folder, got {got}.')
    if not path.suffix or not cv2.haveImageWriter(str(path)):
        raise ValueError(f'Expected an image format like .png or .jpg, got {path.name!r}.')


def write_image(path: Path, rgb: NDArray[np.uint8]) -> None:
    """Write an image; check_image_name has been asked.

    Raises:
        OSError: it cannot be written.
    """
    path.touch()
    if not cv2.imwrite(str(path), rgb[:, :, ::-1]):
        raise OSError(f'Expected {path} to be written, got nothing: is the disk full?')


def read_intrinsics(path: Path | None, shape: tuple[int, ...]) -> Intrinsics:
    """Intrinsics from JSON with fx, fy, cx, cy; None: a Kinect's, scaled to the image."""
    if path is None:
        scale = shape[1] / 640
        return Intrinsics(
            525 * scale, 525 * scale, (shape[1] - 1) / 2, (shape[0] - 1) / 2, shape[1], shape[0]
        )
    names = ('fx', 'fy', 'cx', 'cy')
    values = require(str(path), set(names), json_mapping(read_text(path), path))
    fx, fy, cx, cy = (number(f'{name} in {path}', values[name]) for name in names)
    if not np.isfinite((fx, fy, cx, cy)).all():
        raise ValueError(f'Expected a finite camera in {path}, got {fx:g} {fy:g} {cx:g} {cy:g}.')
    return Intrinsics(fx, fy, cx, cy, shape[1], shape[0])


def any_table(hands: bool) -> PerceptionConfig:
    """Settings that estimate camera pose and table from the image itself.

    hands: detect hands over any side of the table; needs an image of the empty table.
    """
    return PerceptionConfig(
        reference_frame='table',
        human_sides=SIDES if hands else (),
        robot_sides=(),
        background_frames=1,
        empty_at_start=hands,
        min_height=0.006,
        max_object_length=0.6,
        settle_time=0.0,
        absence_time=0.0,
    )


def aligned(background: RgbdFrame, frame: RgbdFrame) -> tuple[RgbdFrame, float]:
    """The background with its depth fitted to a later frame, and the residual deviation, m.

    Stereo cameras drift by some mm between two images, and one image does not show the sensor's
    noise. Fits z_frame = a z + b u + c v + d by least squares to the half of the pixels with the
    smallest residuals; the deviation is a robust estimate over all.
    """
    if background.depth.shape != frame.depth.shape:
        size, got = ('x'.join(map(str, f.depth.shape)) for f in (frame, background))
        raise ValueError(f'Expected a background of {size}, got {got}.')
    rows, columns = np.indices(frame.depth.shape)
    terms = np.stack([background.depth, columns / 640, rows / 640, np.ones_like(frame.depth)], -1)
    both = np.isfinite(background.depth) & np.isfinite(frame.depth)
    if np.count_nonzero(both) < 1000:
        raise ValueError(f'Expected 1000 pixels with depth in both, got {np.count_nonzero(both)}.')
    a, z = terms[both][::7].astype(np.float64), frame.depth[both][::7].astype(np.float64)
    fit = np.array([1.0, 0.0, 0.0, 0.0])
    for _ in range(8):
        off = np.abs(z - a @ fit)
        agree = off <= np.quantile(off, 0.5)
        fit = np.linalg.lstsq(a[agree], z[agree], rcond=None)[0]
    spread = 1.4826 * float(np.median(np.abs(z - a @ fit)))
    return replace(background, depth=np.asarray(terms @ fit, np.float32)), spread


def look_at(
    frame: RgbdFrame,
    intrinsics: Intrinsics,
    background: RgbdFrame | None = None,
    config: PerceptionConfig | None = None,
    catalogue: Catalogue | None = None,
) -> tuple[TableObservation, TabletopPerception]:
    """Run perception on one frame; without a background, the table plane is the background."""
    config = config or any_table(background is not None)
    config = replace(config, background_frames=1)
    if background is not None:
        background, spread = aligned(background, frame)
        config = replace(config, min_height=max(config.min_height, 3 * spread))
    perception = TabletopPerception(config, intrinsics, catalogue or Catalogue(()))
    table = perception.process(replace(background or frame, stamp=1))
    for k in range(2 if background is None else 6):
        table = perception.process(replace(frame, stamp=2 + k * _PERIOD))
    return table, perception


def _learned_entry(
    name: str, frame: RgbdFrame, table: TableObservation, p: TabletopPerception
) -> str:
    """An entry for a world file, as YAML, of the largest unknown object in view.

    A comment after it has the colour of the table.
    """
    sample = p.largest_unknown(frame, table)
    if sample is None:
        raise ValueError('Expected one object on the table to learn, got 0.')
    colour = p.bare_table_colour(frame)
    light = '' if colour is None else f'# table.colour: {[round(c) for c in colour]}\n'
    return object_yaml(catalogue_entry(name, [sample])) + light


def _settings(config: Path | None, world: World | None) -> PerceptionConfig | None:
    """Settings from a file, in the geometry of the world; None: found in the image."""
    if config is None:
        return None
    return load_config(config, None if world is None else world_config(world))


app = App(add_completion=False, rich_markup_mode=None)


@app.command()
def look(
    color: Annotated[Path, typer.Argument(help='Colour image.')],
    depth: Annotated[Path, typer.Argument(help='Depth image, 16 bit, mm, registered to colour.')],
    background_color: Annotated[
        Path | None, typer.Option(help='Colour image of the empty table, to detect hands.')
    ] = None,
    background_depth: Annotated[
        Path | None, typer.Option(help='Depth image of the empty table.')
    ] = None,
    intrinsics: Annotated[
        Path | None, typer.Option(help="JSON with fx, fy, cx, cy; default: a Kinect's.")
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(help='YAML of settings; default: the table is found in the image.'),
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(help='World whose objects are known: a name or a file; default: none are.'),
    ] = None,
    out: Annotated[Path | None, typer.Option(help='File to write the annotated image to.')] = None,
    as_json: Annotated[bool, typer.Option('--json', help='Print JSON instead of text.')] = False,
    learn: Annotated[
        str,
        typer.Option(help='Print an entry of this name for a world file, of the largest object.'),
    ] = '',
) -> None:
    """Detect the objects on a table in a colour and a depth image."""
    try:
        if out is not None:
            check_image_name(out)
        frame = read_frame(color, depth)
        if (background_color is None) != (background_depth is None):
            raise ValueError('Expected both --background-color and --background-depth, got one.')
        empty = None
        if background_color and background_depth:
            empty = read_frame(background_color, background_depth)
        camera = read_intrinsics(intrinsics, frame.depth.shape)
        known = load_world(world) if world is not None else None
        settings = _settings(config, known)
        catalogue = None if known is None else world_catalogue(known)
        table, perception = look_at(frame, camera, empty, settings, catalogue)
        if out is not None and perception.background is not None:
            shown = known if settings is not None else None
            write_image(out, draw(frame.rgb, table, perception.background.view, shown))
        if learn:
            typer.echo(_learned_entry(learn, frame, table, perception), nl=False)
            return
    except (ValueError, OSError) as error:
        typer.echo(f'look: {error}', err=True)
        raise typer.Exit(1) from error
    typer.echo(json.dumps(json_report(table), indent=1) if as_json else text_report(table))


def main() -> None:
    """Entry point of `look`."""
    app(prog_name='look')


if __name__ == '__main__':
    main()
