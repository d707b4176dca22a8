"""Camera pose from the calibration board on the table, and from the depth of the table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from likeme_core.calibration_board import CalibrationBoard
from likeme_core.geometry import Rectangle
from likeme_perception.board_detection import BoardView, find_board
from likeme_perception.errors import NoTableError
from likeme_perception.plane import Plane, ransac_plane
from likeme_perception.rgbd import Intrinsics, RgbdFrame, deproject

Pose = NDArray[np.float64]
Points = NDArray[np.float64]

# What a pose needs: corners, and frames in which each was seen.
_MIN_CORNERS, _MIN_SHARE = 8, 0.5
# px: motion of a corner between frames, and reprojection, beyond which something is wrong.
_STEADY, _MAX_REPROJECTION = 1.0, 1.0
# Difference of the planes by depth and by board beyond which intrinsics, registration or scale of
# the depth, or the board are not as told: rad, and share of the distance.
_MAX_TILT, _MAX_SCALE = np.radians(2.0), 0.03
# Standard deviations with which the residuals count: a corner averaged over frames, px; direction
# and distance of the depth's plane, rad and m.
_CORNER, _DIRECTION, _DISTANCE = 0.1, np.radians(0.1), 0.002
# Depth further than this share of the distance from the board's plane is not of the table.
_NEAR_PLANE = 0.12


class CalibrationError(ValueError):
    """The board is not seen well enough, or camera and board contradict: expected and got."""


@dataclass(frozen=True)
class BoardPlacement:
    """Where the board lies: its middle (m) and its x axis' angle from base_link's (rad).

    thickness: of what it is mounted on, m.
    """

    x: float
    y: float
    yaw: float = 0.0
    thickness: float = 0.0

    def points(self, board: CalibrationBoard) -> Points:
        """The board's inner corners in base_link, (N, 3) m."""
        turn = Rotation.from_euler('z', self.yaw).as_matrix()
        return np.asarray(board.corners @ turn.T + (self.x, self.y, self.thickness))


@dataclass(frozen=True, eq=False)
class Calibration:
    """A camera's pose, and how well it is known.

    pose: 4x4, from the optical frame to base_link. frames, corners: that were used. reprojection:
    root mean square distance of the corners from where the pose puts them, px. on_table: the same
    at the board's distance, m. tilt: angle between the table by depth and by the board alone, rad.
    scale: distance of the table by depth at the corners, over that by the board.
    position_deviation, rotation_deviation: standard deviations of the pose, m and rad.
    """

    pose: Pose
    frames: int
    corners: int
    reprojection: float
    on_table: float
    tilt: float
    scale: float
    position_deviation: float
    rotation_deviation: float


class _SeenCorners(NamedTuple):
    """Mean position (N, 2), px, of the board's corners with numbers (N,)."""

    numbers: NDArray[np.intp]
    pixels: Points


def calibrate(
    frames: Sequence[RgbdFrame],
    camera: Intrinsics,
    board: CalibrationBoard,
    placement: BoardPlacement,
    table: Rectangle,
) -> Calibration:
    """The pose from frames in which neither camera nor board move.

    table: of base_link; depth within it counts.

    Raises:
        CalibrationError: the board is not seen well enough, or depth and board contradict.
    """
    seen = _mean_corners([find_board(frame.rgb, board) for frame in frames], board)
    points = placement.points(board)[seen.numbers]
    depth = _mean_depth(frames)
    by_board = _pose_of_board(points, seen.pixels, camera)
    plane = _table_plane(depth, camera, by_board, table)
    tilt, scale = _check_plane(by_board, plane, points)
    fit = least_squares(
        lambda change: _residuals(_changed(by_board, change), points, seen.pixels, camera, plane),
        np.zeros(6),
        loss='soft_l1',
    )
    pose = _changed(by_board, fit.x)
    error = np.hypot(*(_projected(pose, points, camera) - seen.pixels).T)
    reprojection = float(np.sqrt(np.mean(error**2)))
    if reprojection > _MAX_REPROJECTION:
        raise CalibrationError(
            f'Expected a reprojection error of at most {_MAX_REPROJECTION:g} px, '
            f'got {reprojection:.2f}: is the board flat, and printed at 100 %?'
        )
    covariance = np.linalg.inv(fit.jac.T @ fit.jac)
    deviation = np.sqrt(np.diag(covariance))
    distance = float(np.linalg.norm(points.mean(axis=0) - pose[:3, 3]))
    return Calibration(
        pose, len(frames), len(points), reprojection, reprojection * distance / camera.fx,
        tilt, scale, float(np.linalg.norm(deviation[3:])), float(np.linalg.norm(deviation[:3])),
    )  # fmt: skip


def _mean_corners(views: Sequence[BoardView], board: CalibrationBoard) -> _SeenCorners:
    """The corners seen in most frames, averaged."""
    found: dict[int, list[Points]] = {}
    for view in views:
        for number, pixel in zip(view.corners.tolist(), view.pixels, strict=True):
            found.setdefault(number, []).append(pixel)
    used = {n: np.array(p) for n, p in found.items() if len(p) >= _MIN_SHARE * len(views)}
    if len(used) < _MIN_CORNERS:
        markers = max((view.markers for view in views), default=0)
        raise CalibrationError(
            f"Expected at least {_MIN_CORNERS} of the board's {len(board.corners)} inner corners "
            f'in view, got {len(used)} in {len(views)} frames ({markers} of {board.markers} '
            'markers): is it whole in view, flat, lit, and large enough (a square 15 pixels)?'
        )
    moved = max(
        float(np.linalg.norm(p - np.median(p, axis=0), axis=1).max()) for p in used.values()
    )
    if moved > _STEADY:
        raise CalibrationError(
            f'Expected camera and board at rest, got corners that move by {moved:.1f} px.'
        )
    numbers = np.array(sorted(used), np.intp)
    return _SeenCorners(numbers, np.array([used[n].mean(axis=0) for n in numbers.tolist()]))


def _mean_depth(frames: Sequence[RgbdFrame]) -> NDArray[np.float32]:
    """Mean depth of the frames, NaN where there is none, (H, W) m."""
    stack = np.stack([frame.depth for frame in frames])
    count = np.isfinite(stack).sum(axis=0)
    total = np.nan_to_num(stack).sum(axis=0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan).astype(np.float32)


def _pose_of_board(points: Points, pixels: Points, camera: Intrinsics) -> Pose:
    """The pose by the corners alone; of the two that a plane leaves, the one that fits better."""
    matrix = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]])
    # IPPE wants z = 0.
    height = points[0, 2]
    flat = points - (0, 0, height)
    found, turn, shift = cv2.solvePnP(flat, pixels, matrix, None, flags=cv2.SOLVEPNP_IPPE)
    if not found:
        raise CalibrationError('Expected a pose that puts the corners where they are, got none.')
    rotation = Rotation.from_rotvec(np.ravel(turn)).as_matrix()
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation.T, -rotation.T @ np.ravel(shift)
    pose[2, 3] += height
    return pose


def _table_plane(
    depth: NDArray[np.float32], camera: Intrinsics, pose: Pose, table: Rectangle
) -> Plane:
    """The table's plane in the optical frame, by the depth near where the board puts it."""
    points = deproject(depth, camera)[::2, ::2].reshape(-1, 3)
    points = points[np.isfinite(points[:, 2])].astype(np.float64)
    at = points @ pose[:3, :3].T + pose[:3, 3]
    near = np.abs(at[:, 2]) < _NEAR_PLANE * points[:, 2]
    near &= table.contains(at[:, 0], at[:, 1], -0.01)
    if near.sum() < 500:
        raise CalibrationError(
            f'Expected depth of the table at 500 pixels or more, got {int(near.sum())}: '
            'is depth registered to colour, and the focal length right?'
        )
    try:
        return ransac_plane(points[near], np.random.default_rng(0), 0.005)
    except NoTableError as error:
        raise CalibrationError(str(error)) from None


def _check_plane(pose: Pose, plane: Plane, points: Points) -> tuple[float, float]:
    """Angle (rad) and ratio of distances of the table by depth and by the board's corners."""
    tilt = float(np.arccos(np.clip((pose[:3, :3] @ np.array(plane.normal))[2], -1, 1)))
    on_table = points * (1.0, 1.0, 0.0)
    local = (on_table - pose[:3, 3]) @ pose[:3, :3]
    scale = float(np.mean(-plane.offset / (local @ np.array(plane.normal))))
    if abs(scale - 1) > _MAX_SCALE:
        raise CalibrationError(
            'Expected the table as far by depth as by the board, within '
            f'{100 * _MAX_SCALE:.0f} %, got {100 * (scale - 1):+.1f} %: are the focal length '
            f"({scale:.3f} times as long would fit) and the board's print (a square 48 mm) right?"
        )
    if tilt > _MAX_TILT:
        raise CalibrationError(
            'Expected the table by depth within '
            f'{np.degrees(_MAX_TILT):.0f} degrees of the board, got {np.degrees(tilt):.1f}: '
            'is the board flat on the table?'
        )
    return tilt, scale


def _changed(pose: Pose, change: Points) -> Pose:
    """A pose turned about base_link's axes by a rotation vector, then moved, (6,) rad and m."""
    new = pose.copy()
    new[:3, :3] = Rotation.from_rotvec(change[:3]).as_matrix() @ pose[:3, :3]
    new[:3, 3] += change[3:]
    return new


def _residuals(
    pose: Pose, points: Points, pixels: Points, camera: Intrinsics, plane: Plane
) -> Points:
    """Weighted residuals of corners and plane, in standard deviations."""
    corners = (_projected(pose, points, camera) - pixels) / _CORNER
    up = pose[:3, :3] @ np.array(plane.normal)
    return np.concatenate(
        [corners.ravel(), up[:2] / _DIRECTION, [(pose[2, 3] - plane.offset) / _DISTANCE]]
    )


def _projected(pose: Pose, points: Points, camera: Intrinsics) -> Points:
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    u = camera.fx * local[:, 0] / local[:, 2] + camera.cx
    v = camera.fy * local[:, 1] / local[:, 2] + camera.cy
    return np.stack([u, v], axis=1)
