"""A world from above: table, regions, and where robot, person and simulator put objects."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon as PolygonPatch
from matplotlib.patches import Rectangle as RectanglePatch

from likeme_core.table import Colour
from likeme_core.world import World
from likeme_core.world.values import RegionEntry

#: Length of an arrow for the direction of a push, m.
ARROW = 0.06


def draw_world(world: World) -> Figure:
    """The figure; the robot is below, its left (y > 0) at the left."""
    figure = Figure(figsize=(8.0, 5.6), layout='constrained')
    axes: Axes = figure.subplots()
    top = world.table.top
    outline = np.array(top.corners())
    axes.add_patch(_patch(outline, '#e2c6a0', '#8a6d4a', 1.0))
    for line in world.table.lines:
        (x0, y0), (x1, y1) = line.start, line.end
        axes.plot([-y0, -y1], [x0, x1], color=_hex(line.colour), linewidth=2)
    for entry in world.region_entries:
        _draw_region(axes, entry)
    axes.plot([0], [0], marker='^', markersize=14, color='#464a50')
    axes.annotate('robot', (0, 0), (0.02, 0.0), va='center')
    axes.annotate('person', (-top.centre[1], top.x_max + 0.03), ha='center')
    axes.set(aspect='equal', xlabel='-y, m: right of the robot', ylabel='x, m')
    axes.set_title(
        f'{world.label}\nx: the robot places, arrow: it pushes towards, dotted: objects start',
        fontsize=10,
    )
    axes.margins(0.06)
    axes.set_ylim(-0.06, top.x_max + 0.08)
    return figure


def _draw_region(axes: Axes, entry: RegionEntry) -> None:
    colour = _hex(entry.colour)
    middle = (-entry.start.centre[1], entry.start.x_max + 0.06)
    if entry.area is not None:
        axes.add_patch(_patch(entry.area.corners(), colour, colour, 0.35))
        bounds = entry.area.bounds
        middle = (-entry.area.centre[1], bounds.x_max - 0.02)
    start = entry.start
    axes.add_patch(
        RectanglePatch(
            (-start.y_max, start.x_min), start.y_max - start.y_min, start.x_max - start.x_min,
            fill=False, linestyle=':', edgecolor='black',
        )
    )  # fmt: skip
    kind = '' if entry.reachable else '\n(out of reach)'
    axes.annotate(f'{int(entry.state)} {entry.state.name}{kind}', middle, ha='center', va='top')
    axes.plot(-entry.place[1], entry.place[0], 'x', color='black', markersize=9)
    x, y = entry.push.aim
    for heading in entry.push.headings:
        tail = (-(y - ARROW * heading.y), x - ARROW * heading.x)
        axes.annotate('', (-y, x), tail, arrowprops={'arrowstyle': '->', 'color': 'black'})


def _patch(corners: np.ndarray, face: str, edge: str, alpha: float) -> PolygonPatch:
    """An area of the table plane, turned so that x points up."""
    return PolygonPatch(
        np.column_stack([-corners[:, 1], corners[:, 0]]),
        facecolor=face, edgecolor=edge, alpha=alpha, linewidth=1.5,
    )  # fmt: skip


def _hex(colour: Colour) -> str:
    return '#' + ''.join(f'{part:02x}' for part in colour)
