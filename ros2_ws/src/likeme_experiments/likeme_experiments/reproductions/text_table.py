"""Tables of text, at most 80 columns wide in the paper's world, and sentences under figures."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 80


def paragraph(text: str) -> str:
    """Sentences as lines of the tables' width."""
    return textwrap.fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def aligned(rows: Sequence[Sequence[str]], left: int) -> list[str]:
    """A line for each row, its cells two spaces apart in columns as wide as their widest cell.

    A row of one cell is a line of its own. left: columns that are flush left; others are right.
    """
    full = [row for row in rows if len(row) > 1]
    widths = [max(map(len, column)) for column in zip(*full, strict=True)]
    lines = []
    for row in rows:
        cells = [
            cell.ljust(width) if k < left else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=False))
        ]
        lines.append('  '.join(cells).rstrip())
    return lines


def short(probability: float, digits: int = 2) -> str:
    """A probability without its leading zero: .51, 1.0."""
    text = f'{probability:.{digits}f}'
    return text.removeprefix('0') if text.startswith('0') else text[: digits + 1]


def footnote(figure: Figure, text: str) -> None:
    """Sentences below the axes of a figure with constrained layout, as wide as it allows."""
    columns = round(15 * figure.get_figwidth())
    figure.supxlabel(textwrap.fill(text, columns), fontsize=9)
