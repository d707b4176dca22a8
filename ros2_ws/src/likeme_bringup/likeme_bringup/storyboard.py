"""The demo's picture: a row for each act, with the frames perception annotated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

PANEL_WIDTH = 800


@dataclass(frozen=True, eq=False)
class Panel:
    """One frame. rgb: (H, W, 3) uint8 with the recognised states drawn in."""

    title: str
    rgb: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class StoryboardRow:
    """One act and its frames in order."""

    title: str
    panels: Sequence[Panel]


def draw_storyboard(rows: Sequence[StoryboardRow], path: Path) -> Path:
    """Write the acts as a PNG of `len(rows)` rows; returns the path.

    Raises:
        ValueError: there is no panel.
    """
    columns = max((len(row.panels) for row in rows), default=0)
    if columns == 0:
        raise ValueError('Expected at least one panel to draw, got none.')
    # Here, as the demo starts its cell before it draws.
    import matplotlib as mpl

    # Draw without a display.
    mpl.use('Agg')
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(4.0 * columns, 3.6 * len(rows)), layout='constrained')
    strips = figure.subfigures(len(rows), 1, squeeze=False)
    for strip, row in zip(strips[:, 0], rows, strict=True):
        strip.suptitle(
            row.title, fontsize=14, fontweight='bold', x=0.01, horizontalalignment='left'
        )
        axes = strip.subplots(1, columns, squeeze=False)[0]
        for axis in axes:
            axis.set_axis_off()
        for axis, panel in zip(axes, row.panels, strict=False):
            axis.imshow(_around_table(panel.rgb))
            axis.set_title(panel.title, fontsize=12)
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path


def _around_table(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The frame without the floor around the table, at the width of a panel."""
    height, width = rgb.shape[:2]
    rows = slice(round(0.1 * height), round(0.86 * height))
    part = rgb[rows, round(0.1 * width) : round(0.86 * width)]
    size = PANEL_WIDTH, round(part.shape[0] * PANEL_WIDTH / part.shape[1])
    return np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
