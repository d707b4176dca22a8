"""Detection of the calibration board in a colour image."""

from __future__ import annotations

from typing import Any, NamedTuple, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_core.calibration_board import CalibrationBoard

Pixels = NDArray[np.float64]
ImageB = NDArray[np.uint8]

# Markers are looked for in an image enlarged so much: their cells are 3 pixels wide at 1 m.
_ENLARGED = 2
# A homography takes four points; one marker has them, but barely says how the board is tilted.
_MIN_MARKERS = 2
# Share of a square's side: half the window in which a corner is refined (a marker begins at 0.19),
# and how far it may be from where the markers tell.
_WINDOW, _ASTRAY = 0.15, 0.15
# Where around a corner brightness is compared, in squares, and by how much it differs, of 255.
_BESIDE, _CONTRAST = 0.13, 25


class BoardView(NamedTuple):
    """What one image shows of a board.

    markers: how many were found. corners: numbers of the inner corners, (N,). pixels: where they
    are, (N, 2).
    """

    markers: int
    corners: NDArray[np.intp]
    pixels: Pixels


def find_board(rgb: ImageB, board: CalibrationBoard) -> BoardView:
    """The inner corners of a board in an image (H, W, 3), to a fraction of a pixel."""
    grey = np.asarray(cv2.cvtColor(np.ascontiguousarray(rgb), cv2.COLOR_RGB2GRAY), np.uint8)
    markers = _markers(grey, board)
    none = BoardView(len(markers), np.zeros(0, np.intp), np.zeros((0, 2)))
    if len(markers) < _MIN_MARKERS:
        return none
    on_board = np.concatenate([board.marker_corners(k)[:, :2] for k in markers])
    marked = np.concatenate(list(markers.values()))
    fitted, _ = cv2.findHomography(on_board, marked, cv2.RANSAC)
    if fitted is None:
        return none
    homography = np.asarray(fitted, np.float64)
    expected = _transformed(homography, board.corners[:, :2])
    side = _square_sides(homography, board)
    inside = (expected > side[:, None]).all(axis=1)
    inside &= (expected < np.array(grey.shape[::-1]) - 1 - side[:, None]).all(axis=1)
    numbers = np.flatnonzero(inside & (side > 4) & _contrasts(grey, homography, board))
    found = np.array([_refined(grey, expected[k], side[k]) for k in numbers]).reshape(-1, 2)
    near = np.hypot(*(found - expected[numbers]).T) < _ASTRAY * side[numbers]
    return BoardView(len(markers), numbers[near], found[near])


def _markers(grey: ImageB, board: CalibrationBoard) -> dict[int, Pixels]:
    """Corners (4, 2) of each of the board's markers that was found, by its number."""
    height, width = grey.shape
    size = width * _ENLARGED, height * _ENLARGED
    large = cv2.resize(grey, size, interpolation=cv2.INTER_CUBIC)
    corners, numbers, _ = _detect_markers(np.asarray(large, np.uint8))
    if numbers is None:
        return {}
    centred = [(np.asarray(c, float).reshape(4, 2) + 0.5) / _ENLARGED - 0.5 for c in corners]
    pairs = zip(numbers.ravel().tolist(), centred, strict=True)
    return {number: each for number, each in pairs if number < board.markers}


def _detect_markers(grey: ImageB) -> tuple[Any, Any, Any]:
    """cv2.aruco's detector: OpenCV 4.7 made classes of its functions, and took it from contrib."""
    aruco = cast(Any, getattr(cv2, 'aruco', None))
    if aruco is None:
        raise ValueError(
            'Expected an OpenCV with aruco (4.7 or later, or with contrib), '
            f'got {cv2.__version__}.'
        )
    dictionary = aruco.getPredefinedDictionary(aruco.DICT_4X4_50)
    if hasattr(aruco, 'ArucoDetector'):
        detector = aruco.ArucoDetector(dictionary, _adapted(aruco.DetectorParameters()))
        return cast(tuple[Any, Any, Any], detector.detectMarkers(grey))
    parameters = _adapted(aruco.DetectorParameters_create())
    return cast(tuple[Any, Any, Any], aruco.detectMarkers(grey, dictionary, parameters=parameters))


def _adapted(parameters: Any) -> Any:
    parameters.minMarkerPerimeterRate = 0.02
    parameters.perspectiveRemovePixelPerCell = 8
    return parameters


def _transformed(homography: NDArray[np.float64], points: Pixels) -> Pixels:
    """Points (N, 2) through a homography."""
    mapped = np.column_stack([points, np.ones(len(points))]) @ homography.T
    return np.asarray(mapped[:, :2] / mapped[:, 2:])


def _square_sides(homography: NDArray[np.float64], board: CalibrationBoard) -> Pixels:
    """Least side of a square around each inner corner, pixels, (N,)."""
    corners = board.corners[:, :2]
    middle = _transformed(homography, corners)
    steps = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]]) * board.square
    ends = np.stack([_transformed(homography, corners + step) for step in steps])
    return np.asarray(np.linalg.norm(ends - middle, axis=2).min(axis=0))


def _contrasts(
    grey: ImageB, homography: NDArray[np.float64], board: CalibrationBoard
) -> NDArray[np.bool_]:
    """Whether the four fields around each inner corner are as dark and bright as printed, (N,)."""
    corners = board.corners[:, :2]
    steps = _BESIDE * board.square * np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])
    points = (corners[:, None] + steps).reshape(-1, 2)
    black = board.is_black(board.width / 2 - points[:, 1], board.height / 2 - points[:, 0])
    at = np.rint(_transformed(homography, points)).astype(int)
    column = np.clip(at[:, 0], 0, grey.shape[1] - 1)
    row = np.clip(at[:, 1], 0, grey.shape[0] - 1)
    seen = grey[row, column].astype(int).reshape(-1, 4)
    dark = black.reshape(-1, 4)
    brightest = np.where(dark, seen, 0).max(axis=1)
    darkest = np.where(dark, 255, seen).min(axis=1)
    return np.asarray(darkest - brightest > _CONTRAST)


def _refined(grey: ImageB, corner: Pixels, side: float) -> Pixels:
    """The saddle point near a corner."""
    half = max(2, round(_WINDOW * side))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
    start = corner.astype(np.float32).reshape(1, 1, 2)
    found = cv2.cornerSubPix(grey, start, (half, half), (-1, -1), stop)
    return np.asarray(found, float).reshape(2)
