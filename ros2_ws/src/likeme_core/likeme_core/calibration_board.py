"""The printed board by which a camera is calibrated: a chessboard with markers (ChArUco).

Board frame: origin in the middle of the board, x up the sheet, y to its left, z out of it, m. In
each white square lies a marker of OpenCV's dictionary DICT_4X4_50, in the order of the rows from
the top left. The chessboard's inner corners are what is measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

#: Of DICT_4X4_50: the cells of each marker, row by row from its top left, 1: white.
MARKER_BITS = (0xB532, 0x0F9A, 0x332D, 0x9946, 0x549E, 0x79CD, 0x9E2E, 0xC4F2, 0xFEDA, 0xCF56)
#: Cells along a marker's side: four of bits within a black border.
_CELLS = 6


@dataclass(frozen=True)
class CalibrationBoard:
    """A board: squares in a row, rows, sides of squares and markers (m); fits A4 and Letter."""

    columns: int = 5
    rows: int = 4
    square: float = 0.048
    marker: float = 0.030

    @property
    def width(self) -> float:
        """Along y, m."""
        return self.columns * self.square

    @property
    def height(self) -> float:
        """Along x, m."""
        return self.rows * self.square

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Inner corners of the chessboard, row by row from the top left, (N, 3) m."""
        across, down = np.meshgrid(np.arange(1, self.columns), np.arange(1, self.rows))
        return self._points(
            np.asarray(across.ravel() * self.square), np.asarray(down.ravel() * self.square)
        )

    def marker_corners(self, number: int) -> NDArray[np.float64]:
        """Corners of a marker, clockwise from its top left as OpenCV gives them, (4, 3) m."""
        row, column = self._white_squares[number]
        margin = (self.square - self.marker) / 2
        left, top = column * self.square + margin, row * self.square + margin
        right, bottom = left + self.marker, top + self.marker
        return self._points(
            np.array([left, right, right, left]), np.array([top, top, bottom, bottom])
        )

    @cached_property
    def black(self) -> NDArray[np.float64]:
        """All black rectangles: left, top, width, height from the board's top left, (N, 4) m."""
        cells = []
        for row in range(self.rows):
            for column in range(self.columns):
                if (row + column) % 2 == 0:
                    left, top = column * self.square, row * self.square
                    cells.append((left, top, self.square, self.square))
        side, margin = self.marker / _CELLS, (self.square - self.marker) / 2
        for number, (row, column) in enumerate(self._white_squares):
            left, top = column * self.square + margin, row * self.square + margin
            for line, cell in np.argwhere(~_white_cells(number)):
                cells.append((left + cell * side, top + line * side, side, side))
        return np.array(cells)

    def is_black(
        self, across: NDArray[np.float64], down: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Whether points are black; m from the board's top left to the right and down, (N,)."""
        column, row = np.floor(across / self.square), np.floor(down / self.square)
        black = (row + column) % 2 == 0
        margin, side = (self.square - self.marker) / 2, self.marker / _CELLS
        for number, (marker_row, marker_column) in enumerate(self._white_squares):
            cell = np.floor((across - marker_column * self.square - margin) / side)
            line = np.floor((down - marker_row * self.square - margin) / side)
            inside = (cell >= 0) & (cell < _CELLS) & (line >= 0) & (line < _CELLS)
            white = _white_cells(number)
            black[inside] = ~white[line[inside].astype(int), cell[inside].astype(int)]
        within = (across >= 0) & (across < self.width) & (down >= 0) & (down < self.height)
        return np.asarray(black & within)

    @cached_property
    def _white_squares(self) -> list[tuple[int, int]]:
        """Row and column of the white squares, in the order of their markers."""
        return [
            (row, column)
            for row in range(self.rows)
            for column in range(self.columns)
            if (row + column) % 2
        ]

    @property
    def markers(self) -> int:
        """How many markers there are."""
        return len(self._white_squares)

    def _points(
        self, across: NDArray[np.floating], down: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Points of the board frame from m right of and below the board's top left, (N, 3)."""
        return np.stack(
            [self.height / 2 - down, self.width / 2 - across, np.zeros(len(across))], axis=1
        )


def _white_cells(number: int) -> NDArray[np.bool_]:
    """The cells of a marker with its border, (6, 6)."""
    cells = np.zeros((_CELLS, _CELLS), bool)
    bits = [MARKER_BITS[number] >> (15 - k) & 1 for k in range(16)]
    cells[1:-1, 1:-1] = np.array(bits, bool).reshape(4, 4)
    return cells


#: The board that calibrate.sh prints.
BOARD = CalibrationBoard()
