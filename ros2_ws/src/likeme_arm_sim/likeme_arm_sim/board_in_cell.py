"""The calibration board as a sheet on the simulated table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from likeme_arm_sim.meshes import Floats, box
from likeme_arm_sim.renderer import PaintedPlane
from likeme_core.calibration_board import CalibrationBoard

#: Of the sheet, m.
_MARGIN, _THICKNESS = 0.008, 0.0004
_INK, _PAPER = 38, 236


def board_on_table(board: CalibrationBoard, x: float, y: float, yaw: float) -> PaintedPlane:
    """The board with its middle at (x, y), m, and its x axis at an angle (rad) in base_link."""
    size = (board.height + 2 * _MARGIN, board.width + 2 * _MARGIN, _THICKNESS)
    sheet = box(size, (0, 0, 0), (0.0, 0.0, 0.0))
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, (x, y, _THICKNESS / 2)

    def paint(points: Floats) -> NDArray[np.uint8]:
        local = (points - (x, y, 0.0)) @ turn
        black = board.is_black(board.width / 2 - local[:, 1], board.height / 2 - local[:, 0])
        grey = np.where(black, _INK, _PAPER).astype(np.uint8)
        return np.repeat(grey[:, None], 3, axis=1)

    return PaintedPlane(sheet.transformed(pose), paint)
