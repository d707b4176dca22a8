"""Command `calibrate`: camera pose from a printed board on the table, into a world file."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NoReturn

import numpy as np
import typer

from likeme_bags.errors import BagError
from likeme_core.calibration_board import BOARD
from likeme_core.camera_mount import CameraMount, camera_at
from likeme_core.cli import Domain, Network
from likeme_core.typer_app import App
from likeme_core.world import World, load_world
from likeme_core.world.edit import check_own_file, with_values, write_world
from likeme_perception.calibration import BoardPlacement, Calibration, Pose, calibrate
from likeme_perception.camera_view import CameraView
from likeme_perception.image_pairs import check_image_name, write_image
from likeme_perception.observation import TableObservation
from likeme_perception.overlay import draw
from likeme_perception.rgbd import Intrinsics
from likeme_perception.touched_points import (
    COLUMNS,
    TouchedPoints,
    pose_of_touched_points,
    read_points,
)
from likeme_replay.camera_tools.board_sheet import write_board
from likeme_replay.camera_tools.frame_source import CameraFrames, stored_frames

#: Where the picture goes if --out is not given.
OUT = Path('out/calibrate')
_INTRINSICS = ('width', 'height', 'fx', 'fy', 'cx', 'cy')

app = App(add_completion=False, rich_markup_mode=None)


@app.command()
def calibrate_command(
    inputs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar='[BAG | FOLDER | COLOUR DEPTH...]', help='Frames in which nothing moves.'
        ),
    ] = None,
    live: Annotated[bool, typer.Option('--live', help='From the running camera.')] = False,
    print_to: Annotated[
        Path | None, typer.Option('--print', help='Write the board as PDF into this folder.')
    ] = None,
    points: Annotated[
        Path | None,
        typer.Option(help=f'CSV of points that the arm touched: {",".join(COLUMNS)}, m.'),
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(
            metavar='FILE', help='World file that gets the pose; default: only print it.'
        ),
    ] = None,
    x: Annotated[
        float | None, typer.Option(help="The board's middle in base_link, m; default: table's.")
    ] = None,
    y: Annotated[float | None, typer.Option(help='The same.')] = None,
    yaw: Annotated[
        float, typer.Option(help="Angle of the board's x axis from base_link's, degrees.")
    ] = 0.0,
    thickness: Annotated[
        float, typer.Option(min=0.0, max=50.0, help='Of what the sheet is glued to, mm.')
    ] = 0.0,
    frames: Annotated[int, typer.Option(min=1, max=300, help='How many are averaged.')] = 15,
    intrinsics: Annotated[
        Path | None,
        typer.Option(help='Of images: JSON with fx, fy, cx, cy; default: FOLDER has it.'),
    ] = None,
    out: Annotated[Path | None, typer.Option(help='Picture with the regions drawn in.')] = None,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Find a camera's pose from the board on the table and the table's depth."""
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    given = inputs or []
    if [print_to is not None, points is not None, live, bool(given)].count(True) != 1:
        _refuse('Expected one of --print, --points, --live, images or a recording; see --help.')
    try:
        if print_to is not None:
            for sheet in write_board(print_to, BOARD):
                print(f'Written: {sheet}. Print it at 100 %, measure the ruler, lay it flat.')
            return
        if world is not None:
            check_own_file(Path(world))
        if out is not None:
            check_image_name(out)
        known = load_world(world) if world is not None else load_world()
        path = None if world is None else Path(world)
        if points is not None:
            touched = pose_of_touched_points(*read_points(points))
            _write(known, path, touched.pose, known.camera, [points_report(touched)])
            return
        taken = (
            _live(frames, domain, network) if live else stored_frames(given, frames, intrinsics)
        )
        centre = known.table.top.centre
        placement = BoardPlacement(
            centre[0] if x is None else x, centre[1] if y is None else y, np.radians(yaw),
            1e-3 * thickness,
        )  # fmt: skip
        found = calibrate(taken.frames, taken.intrinsics, BOARD, placement, known.table.top)
        _write(
            known, path, found.pose, _with_intrinsics(known.camera, taken.intrinsics),
            board_report(found),
        )  # fmt: skip
        _draw(known, taken, found.pose, out)
    except (ValueError, OSError, BagError) as error:
        print(f'calibrate: {" ".join(str(error).split())}', file=sys.stderr)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        print('calibrate: ended, nothing is written.', file=sys.stderr)
        raise typer.Exit(130) from None


def _live(count: int, domain: int, network: bool) -> CameraFrames:
    # Imported here: the rest needs no ROS.
    from likeme_replay.ros.live_frames import live_frames
    from likeme_replay.ros.waiting_node import ReplayFailedError

    try:
        with live_frames(domain, network, count) as camera:
            return CameraFrames(*camera.take(count))
    except ReplayFailedError as error:
        raise ValueError(str(error)) from None


def _write(
    known: World, path: Path | None, pose: Pose, lens: CameraMount, lines: list[str]
) -> None:
    """Print the result, and write the world file if there is one; lens: with the intrinsics."""
    camera = camera_at(pose, lens)
    print('\n'.join([pose_report(camera), *lines]))
    if path is not None:
        print(_change(known.camera, pose))
        values = camera_values(camera, known.camera)
        write_world(path, with_values(path.read_text(encoding='utf-8'), 'camera', values))
        print(f'Written: {path}; a running cell takes it over when it is started anew.')


def _draw(known: World, taken: CameraFrames, pose: Pose, out: Path | None) -> None:
    """Draw the regions as they lie by the pose."""
    if out is None:
        OUT.mkdir(parents=True, exist_ok=True)
        out = OUT / f'{known.name}.png'
    frame, view = taken.frames[-1], CameraView(taken.intrinsics, pose)
    write_image(out, draw(frame.rgb, TableObservation(frame.stamp, frame.frame_id), view, known))
    print(f'Regions as the camera now sees them: {out}')


def _with_intrinsics(camera: CameraMount, intrinsics: Intrinsics) -> CameraMount:
    return replace(camera, **{name: getattr(intrinsics, name) for name in _INTRINSICS})


def camera_values(camera: CameraMount, before: CameraMount) -> dict[str, Any]:
    """What is to change in a world file: 0.1 mm, 0.00001 rad; intrinsics if they differ."""
    values: dict[str, Any] = {
        'position': [round(v, 4) for v in camera.position],
        'target': [round(v, 4) for v in camera.target],
        'roll': round(camera.roll, 5),
    }
    if any(getattr(camera, name) != getattr(before, name) for name in _INTRINSICS):
        values |= {name: getattr(camera, name) for name in _INTRINSICS}
    return values


def pose_report(camera: CameraMount) -> str:
    """The pose, for a person."""
    x, y, z = camera.position
    ahead = ' '.join(f'{v:+.3f}' for v in camera.target)
    return (
        f'Camera in base_link: position x {x:+.4f} y {y:+.4f} z {z:+.4f} m, it looks at '
        f'{ahead} m, roll {np.degrees(camera.roll):+.2f} degrees.'
    )


def board_report(found: Calibration) -> list[str]:
    """How well a pose is known, for a person."""
    return [
        f'Board: {found.corners} of {len(BOARD.corners)} corners in {found.frames} frames, '
        f'reprojection error {found.reprojection:.2f} px, {1e3 * found.on_table:.1f} mm there.',
        f"Depth: the table's plane is {np.degrees(found.tilt):.2f} degrees off the board's, "
        f'its distance {100 * (found.scale - 1):+.1f} % (both small: the intrinsics fit).',
        f'Expected error of the pose: {1e3 * found.position_deviation:.1f} mm, '
        f'{np.degrees(found.rotation_deviation):.2f} degrees (one standard deviation).',
    ]


def points_report(found: TouchedPoints) -> str:
    """How well a pose from touched points is known, for a person."""
    return (
        f'Points: {found.points}, {1e3 * found.residual:.1f} mm from where the pose puts them; '
        f'{1e3 * found.left_out:.1f} mm at a point that is left out: expect that of others.'
    )


def _change(before: CameraMount, pose: Pose) -> str:
    was = before.pose()
    moved = 1e3 * float(np.linalg.norm(pose[:3, 3] - was[:3, 3]))
    cosine = (np.trace(pose[:3, :3].T @ was[:3, :3]) - 1) / 2
    turned = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return f'The file had it {moved:.1f} mm and {turned:.2f} degrees from there.'


def _refuse(sentence: str) -> NoReturn:
    print(f'calibrate: {sentence}', file=sys.stderr)
    raise typer.Exit(2)


def main() -> None:
    """Entry point of `calibrate`."""
    app()


if __name__ == '__main__':
    main()
