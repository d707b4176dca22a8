"""The table seen from above, as text: regions by their borders, objects by their names.

x points up (away from the robot) and y to the left, as the robot sees the table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from likeme_core.regions import Regions
from likeme_core.world import World
from likeme_operator.desk_view import SeenObject

BELOW, BESIDE = '─', '│'


def table_plan(
    world: World, objects: Sequence[SeenObject], width: int, height: int, wanted: str = ''
) -> list[str]:
    """Lines of a plan of the regions with the objects that lie in them.

    Args:
        world: whose regions are drawn.
        objects: those whose centroid is known are drawn where it is.
        width: columns.
        height: lines.
        wanted: object that is written in capitals.
    """
    if width < 8 or height < 3:
        return []
    grid = _Grid(world.regions, width, height)
    for state, area in zip(world.regions.states, world.regions.areas, strict=True):
        if area is not None:
            grid.write(*area.centre, state.name, row=grid.top_of(state))
    for item in objects:
        if not math.isnan(item.x) and not math.isnan(item.y):
            name = item.name.upper() if item.name == wanted else item.name
            # In brackets: not seen in this frame, it was there when it last was.
            grid.write(item.x, item.y, name if item.visible else f'({name})', row=None)
    return grid.lines()


class _Grid:
    """Characters over the smallest rectangle around the regions, and a margin."""

    def __init__(self, regions: Regions, width: int, height: int) -> None:
        area = regions.work_area
        margin = 0.04 * max(area.x_max - area.x_min, area.y_max - area.y_min)
        self._top, self._left = area.x_max + margin, area.y_max + margin
        self._dx = (area.x_max - area.x_min + 2 * margin) / height
        self._dy = (area.y_max - area.y_min + 2 * margin) / width
        self._states = [
            [
                regions.state_of(
                    self._top - (r + 0.5) * self._dx, self._left - (c + 0.5) * self._dy
                )
                for c in range(width)
            ]
            for r in range(height)
        ]
        self._cells = [[self._border(r, c) for c in range(width)] for r in range(height)]

    def lines(self) -> list[str]:
        return [''.join(row) for row in self._cells]

    def top_of(self, state: object) -> int:
        """The second row of a region, below its border."""
        rows = [r for r, row in enumerate(self._states) if state in row]
        return min(rows[0] + 1, len(self._cells) - 1) if rows else 0

    def write(self, x: float, y: float, text: str, row: int | None) -> None:
        """Write a text with its middle at a point; row: instead of the point's."""
        height, width = len(self._cells), len(self._cells[0])
        at = int((self._top - x) / self._dx) if row is None else row
        at = min(max(at, 0), height - 1)
        text = text[:width]
        begin = int((self._left - y) / self._dy) - len(text) // 2
        begin = min(max(begin, 0), width - len(text))
        # Of two names in one place the later one moves to a free row.
        for shift in (0, 1, -1, 2, -2):
            if 0 <= at + shift < height and self._free(at + shift, begin - 1, len(text) + 2):
                at += shift
                break
        self._cells[at][begin : begin + len(text)] = text

    def _free(self, row: int, begin: int, length: int) -> bool:
        there = self._cells[row][max(0, begin) : begin + length]
        return all(each in (' ', BELOW, BESIDE) for each in there)

    def _border(self, r: int, c: int) -> str:
        here, rows, columns = self._states[r][c], len(self._states), len(self._states[0])
        right = self._states[r][min(c + 1, columns - 1)]
        below = self._states[min(r + 1, rows - 1)][c]
        if right != here:
            return BESIDE
        return BELOW if below != here else ' '
