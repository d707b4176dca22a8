"""Camera poses by the calibration board in the simulated cell, beside the true ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import report
from likeme_arm_sim.board_in_cell import board_on_table
from likeme_arm_sim.cell import Cell, CellSettings
from likeme_core.calibration_board import BOARD
from likeme_core.camera_mount import CameraMount
from likeme_core.paper_world import WORLD
from likeme_core.progress_bar import counted
from likeme_perception.calibration import BoardPlacement, Calibration, calibrate
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres

SEEDS, FRAMES = 40, 15


def main() -> None:
    """Draw cameras and boards, calibrate, compare."""
    report.option_parser('calibrate').parse_args()
    errors = np.array([error_of(seed) for seed in counted(range(SEEDS), 'cameras', SEEDS)])
    position, rotation, pixels = errors.T
    refused = int(np.isnan(position).sum())
    report.publish(
        'calibrate',
        [
            report.Bar('position, worst', float(np.nanmax(position)), 2.0, 'mm', n=SEEDS),
            report.Bar('position, median', float(np.nanmedian(position)), None, 'mm', n=SEEDS),
            report.Bar('rotation, worst', float(np.nanmax(rotation)), 0.2, 'degrees', n=SEEDS),
            report.Bar(
                'rotation, median', float(np.nanmedian(rotation)), None, 'degrees', n=SEEDS
            ),
            report.Bar('reprojection, median', float(np.nanmedian(pixels)), None, 'px', n=SEEDS),
            report.Bar('refused', refused, 0, 'poses', n=SEEDS),
        ],
        notes={'frames averaged': FRAMES},
    )


def error_of(seed: int) -> tuple[float, float, float]:
    """Error of position (mm) and rotation (degrees), and reprojection (px); NaN: refused."""
    rng = np.random.default_rng(seed)
    camera = CameraMount(
        (rng.uniform(-0.1, 0.25), rng.uniform(-0.4, 0.4), rng.uniform(0.75, 1.05)),
        (rng.uniform(0.39, 0.49), rng.uniform(-0.05, 0.05), 0.0),
        roll=rng.uniform(-0.25, 0.25),
    )
    board = rng.uniform(0.40, 0.48), rng.uniform(-0.06, 0.06), rng.uniform(-0.4, 0.4)
    try:
        found = calibrated(camera, board, seed)
    except ValueError as error:
        print(f'seed {seed}: {error}')
        return float('nan'), float('nan'), float('nan')
    return (*pose_error(found.pose, camera.pose()), found.reprojection)


def calibrated(camera: CameraMount, board: tuple[float, float, float], seed: int) -> Calibration:
    """Calibrate a camera of the cell; board: x, y (m), angle (rad)."""
    world = replace(WORLD, camera=camera)
    offtable = CellSettings(initial_states=dict.fromkeys(world.objects, world.states[-1]))
    cell = Cell(world, seed, offtable, lying=(board_on_table(BOARD, *board),))
    frames = [
        RgbdFrame(k, 'camera', images.rgb, depth_in_metres(images.depth_mm))
        for k, images in enumerate(cell.frame() for _ in range(FRAMES))
    ]
    intrinsics = Intrinsics(
        camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height
    )
    return calibrate(frames, intrinsics, BOARD, BoardPlacement(*board), world.table.top)


def pose_error(found: NDArray[np.float64], true: NDArray[np.float64]) -> tuple[float, float]:
    """Distance (mm) and angle (degrees) between two poses."""
    turn = Rotation.from_matrix(found[:3, :3] @ true[:3, :3].T)
    distance = 1e3 * float(np.linalg.norm(found[:3, 3] - true[:3, 3]))
    return distance, float(np.degrees(np.linalg.norm(turn.as_rotvec())))


if __name__ == '__main__':
    main()
