"""Camera pose from points that the arm touched and the camera saw."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from likeme_perception.calibration import CalibrationError

Points = NDArray[np.float64]

#: Columns of the file: a point in base_link and in the optical frame, m.
COLUMNS = ('x', 'y', 'z', 'camera_x', 'camera_y', 'camera_z')
_MIN_POINTS = 4
# m: spread of the points across their line, below which they do not tell a turn about it; greatest
# error at a point.
_MIN_SPREAD, _MAX_ERROR = 0.03, 0.02


class TouchedPoints(NamedTuple):
    """A pose (4x4, optical frame to base_link) from some points.

    points: how many. residual: root mean square distance of the points, m. left_out: the same for
    each point by the pose of the others; what to expect of a new point.
    """

    pose: Points
    points: int
    residual: float
    left_out: float


def read_points(path: Path) -> tuple[Points, Points]:
    """Points in base_link and in the optical frame, (N, 3) m each, from a CSV with COLUMNS.

    Raises:
        ValueError: columns are missing, or a value is no finite number.
    """
    with path.open(encoding='utf-8', newline='') as file:
        reader = csv.DictReader(file, skipinitialspace=True)
        missing = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
        if missing:
            raise ValueError(
                f'Expected the columns {",".join(COLUMNS)} in {path}, got no {missing[0]}.'
            )
        rows = [_numbers(row, f'{path}:{reader.line_num}') for row in reader]
    values = np.array(rows, float).reshape(-1, 6)
    return values[:, :3], values[:, 3:]


def _numbers(row: Mapping[str, str | None], where: str) -> list[float]:
    try:
        values = [float(row[name] or '') for name in COLUMNS]
    except ValueError:
        values = [np.nan]
    if not np.isfinite(values).all():
        raise ValueError(f'{where}: Expected six finite numbers, got {list(row.values())}.')
    return values


def pose_of_touched_points(base: Points, camera: Points) -> TouchedPoints:
    """The rigid transform with the least squared distances (Kabsch 1976; Umeyama 1991).

    Raises:
        CalibrationError: too few points, on one line, or too far from each other's.
    """
    if len(base) < _MIN_POINTS:
        raise CalibrationError(f'Expected at least {_MIN_POINTS} points, got {len(base)}.')
    spread = np.linalg.svd(base - base.mean(axis=0))[1] / np.sqrt(len(base))
    if spread[1] < _MIN_SPREAD:
        raise CalibrationError(
            f'Expected points {1e3 * _MIN_SPREAD:.0f} mm or more off one line, '
            f'got {1e3 * spread[1]:.0f} mm.'
        )
    pose = _rigid(base, camera)
    error = _distances(pose, base, camera)
    if error.max() > _MAX_ERROR:
        raise CalibrationError(
            f'Expected points within {1e3 * _MAX_ERROR:.0f} mm, got {1e3 * error.max():.0f} mm at '
            f'point {int(error.argmax()) + 1}.'
        )
    others = [np.arange(len(base)) != k for k in range(len(base))]
    left_out = [
        _distances(_rigid(base[kept], camera[kept]), base[~kept], camera[~kept])[0]
        for kept in others
    ]
    return TouchedPoints(
        pose, len(base), float(np.sqrt(np.mean(error**2))),
        float(np.sqrt(np.mean(np.square(left_out)))),
    )  # fmt: skip


def _rigid(base: Points, camera: Points) -> Points:
    from_middle, to_middle = camera.mean(axis=0), base.mean(axis=0)
    u, _, v = np.linalg.svd((camera - from_middle).T @ (base - to_middle))
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
    pose = np.eye(4)
    pose[:3, :3] = (u @ flip @ v).T
    pose[:3, 3] = to_middle - pose[:3, :3] @ from_middle
    return pose


def _distances(pose: Points, base: Points, camera: Points) -> Points:
    return np.asarray(np.linalg.norm(camera @ pose[:3, :3].T + pose[:3, 3] - base, axis=1))
