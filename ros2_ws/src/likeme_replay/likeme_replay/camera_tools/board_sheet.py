"""The calibration board as PDF, true to scale."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from likeme_core.calibration_board import CalibrationBoard

_MM_PER_INCH = 25.4


class Paper(NamedTuple):
    """A sheet in landscape, mm."""

    name: str
    width: float
    height: float


PAPERS = (Paper('a4', 297.0, 210.0), Paper('letter', 279.4, 215.9))


def write_board(folder: Path, board: CalibrationBoard) -> list[Path]:
    """Write board_a4.pdf and board_letter.pdf; their paths.

    Raises:
        OSError: they cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for paper in PAPERS:
        paths.append(folder / f'board_{paper.name}.pdf')
        figure = board_figure(board, paper)
        # Without dates, so that the same board is the same file.
        metadata = {'CreationDate': None, 'ModDate': None, 'Title': 'Calibration board'}
        figure.savefig(paths[-1], format='pdf', metadata=metadata)
    return paths


def board_figure(board: CalibrationBoard, paper: Paper) -> Figure:
    """The sheet; its axes count mm from the paper's lower left corner."""
    figure = Figure(figsize=(paper.width / _MM_PER_INCH, paper.height / _MM_PER_INCH))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, paper.width), ylim=(0, paper.height))
    axes.set_axis_off()
    left, top = (paper.width - 1e3 * board.width) / 2, (paper.height + 1e3 * board.height) / 2
    for x, y, width, height in 1e3 * board.black:
        corner = (left + x, top - y - height)
        axes.add_patch(Rectangle(corner, width, height, facecolor='black', linewidth=0))
    _arrow(axes, left / 2, paper.height / 2)
    _ruler(axes, paper.width - left / 2, paper.height / 2)
    return figure


def _arrow(axes: Axes, x: float, y: float) -> None:
    """The board's x axis."""
    axes.annotate(
        '', (x + 4, y + 60), (x + 4, y - 60), arrowprops={'arrowstyle': '-|>', 'color': 'black'}
    )
    text = 'x: away from the robot, towards the person'
    axes.text(x - 2, y, text, rotation=90, ha='center', va='center', fontsize=9)


def _ruler(axes: Axes, x: float, y: float) -> None:
    """100 mm to be measured after printing."""
    axes.plot([x - 4, x - 4], [y - 50, y + 50], color='black', linewidth=0.6)
    for end in (-50, 50):
        axes.plot([x - 6, x - 2], [y + end, y + end], color='black', linewidth=0.6)
    text = 'must be 100 mm long: print at 100 %'
    axes.text(x + 2, y, text, rotation=90, ha='center', va='center', fontsize=9)
