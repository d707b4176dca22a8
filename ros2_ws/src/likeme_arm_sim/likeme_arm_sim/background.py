"""The static bodies in view: floor, table with its painted lines, and the robot's pedestal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from likeme_arm_sim.meshes import Floats, box
from likeme_arm_sim.renderer import LIGHT, PaintedPlane, RenderBody
from likeme_core.table import PaintedLine, Table

BEECH = np.array([226.0, 198.0, 160.0])
FLOOR = np.array([130.0, 134.0, 138.0])


def cell_background(table: Table) -> tuple[RenderBody | PaintedPlane, ...]:
    """The static part of the cell, in base_link."""
    top = table.top
    x, y = top.centre
    size = (top.x_max - top.x_min, top.y_max - top.y_min, table.thickness)
    slab = box(size, (0, 0, 0), (x, y, -table.thickness / 2))
    floor = box((6.0, 6.0, 0.02), (0, 0, 0), (x, y, table.floor_z - 0.01))
    height, middle = -table.thickness - table.floor_z, (table.floor_z - table.thickness) / 2
    legs = [
        box((0.05, 0.05, height), (150, 152, 156), (a, b, middle))
        for a in (top.x_min + 0.04, top.x_max - 0.04)
        for b in (top.y_min + 0.04, top.y_max - 0.04)
    ]
    pedestal = box((0.30, 0.26, -table.floor_z), (70, 74, 80), (-0.03, 0.0, table.floor_z / 2))
    return (
        PaintedPlane(floor, lambda points: _floor_paint(points, table)),
        *(RenderBody(mesh, np.eye(4)) for mesh in (*legs, pedestal)),
        PaintedPlane(slab, lambda points: _table_paint(points, table), shadows_at=0.0),
    )


def _table_paint(points: Floats, table: Table) -> NDArray[np.uint8]:
    """Beech boards along y, a dark edge, and the painted lines."""
    x, y, z = points.T
    board = np.floor((x - table.top.x_min) / 0.11)
    tone = 7.0 * np.sin(12.9898 * board + 4.0)
    drift = 0.004 * np.sin(9.0 * y + 2.1 * board) + 0.002 * np.sin(31.0 * y + board)
    rings = np.sin(760.0 * (x + drift)) + 0.6 * np.sin(1730.0 * (x + 1.7 * drift) + 3.0 * board)
    pores = _noise(np.floor(x / 0.0012), np.floor(y / 0.02)) - 0.5
    colour = BEECH + (tone + 3.0 * rings + 7.0 * pores)[:, None] * np.array([1.0, 0.95, 0.8])
    seam = np.abs((x - table.top.x_min) / 0.11 - np.round((x - table.top.x_min) / 0.11)) < 0.008
    colour[seam] *= 0.86
    for line in table.lines:
        colour[_on_line(points, line) & (z > -1e-4)] = line.colour
    colour[z < -1e-4] = BEECH * 0.72
    return np.asarray(np.clip(colour, 0, 255), np.uint8)


def _on_line(points: Floats, line: PaintedLine) -> NDArray[np.bool_]:
    """Whether points lie on a painted line."""
    start, end = np.array(line.start), np.array(line.end)
    length = float(np.linalg.norm(end - start))
    (along_x, along_y), away = (end - start) / length, points[:, :2] - start
    beside = np.abs(away[:, 1] * along_x - away[:, 0] * along_y)
    along = away[:, 0] * along_x + away[:, 1] * along_y
    return np.asarray((beside < line.width / 2) & (along > -1e-6) & (along < length + 1e-6))


def _floor_paint(points: Floats, table: Table) -> NDArray[np.uint8]:
    """Speckled grey linoleum with the soft shadow of the table."""
    x, y, _ = points.T
    speckle = _noise(np.floor(x / 0.004), np.floor(y / 0.004)) - 0.5
    cloud = np.sin(7.0 * x + 1.0) * np.sin(6.0 * y)
    colour = FLOOR + (14.0 * speckle + 4.0 * cloud)[:, None]
    shift_x, shift_y = -table.floor_z * LIGHT[:2] / LIGHT[2]
    outside_x = np.maximum(table.top.x_min - shift_x - x, x - table.top.x_max + shift_x)
    outside_y = np.maximum(table.top.y_min - shift_y - y, y - table.top.y_max + shift_y)
    shaded = np.clip(0.5 - np.maximum(outside_x, outside_y) / 0.08, 0, 1)
    return np.asarray(np.clip(colour * (1 - 0.30 * shaded)[:, None], 0, 255), np.uint8)


def _noise(i: Floats, j: Floats) -> Floats:
    """A fixed pseudo-random value in [0, 1) for each integer cell (the usual shader hash)."""
    value = np.sin(i * 127.1 + j * 311.7) * 43758.5453
    return np.asarray(value - np.floor(value))
