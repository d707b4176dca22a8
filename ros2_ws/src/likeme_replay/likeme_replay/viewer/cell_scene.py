"""The 3-D scene of a cell (table, regions, objects) and the states' probabilities over time."""

from __future__ import annotations

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from likeme_core.stamps import SECOND
from likeme_core.world import World
from likeme_core.world.values import UNKNOWN
from likeme_perception.overlay import state_colour
from likeme_perception.top_view import Shape
from likeme_replay.viewer.scene_stream import Pace, SceneStream
from likeme_replay.viewer.seen_table import SeenObject, SeenTable

#: Shortest time between two tables in a recording, ns: a recording of hours stays small.
TABLE_PERIOD = SECOND // 10
#: Radius of outlines and their height above the table, m: over the noise of the depth readings.
_LINE, _ABOVE = 0.003, 0.008
_TABLE_COLOUR = (120, 105, 90)
_SMALLEST = 0.01


class CellScene:
    """Logs table, regions, objects and unknown objects in `cell`, and `states/OBJECT`."""

    def __init__(self, stream: SceneStream, world: World) -> None:
        self._stream, self._world = stream, world
        self._pace = Pace(TABLE_PERIOD)
        stream.log_static('cell', rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        self._log_table()
        self._log_regions()
        names = [state.name for state in world.states]
        colours = [entry.colour for entry in world.region_entries]
        for name in world.objects:
            stream.log_static(f'states/{name}', rr.SeriesLines(names=names, colors=colours))

    def show_table(self, table: SeenTable) -> None:
        """Show what is where; tables that follow too soon are left out."""
        if not self._pace.due(table.stamp):
            return
        for seen in table.objects:
            self._show_object(table.stamp, seen)
        unknown = [o for o in table.unknown_objects if o.shape is not None]
        self._stream.log(
            table.stamp,
            'cell/unknown_objects',
            _ellipsoids(
                [o.shape for o in unknown if o.shape],
                [state_colour(None, None)] * len(unknown),
                [o.name for o in unknown],
            ),
        )

    def _show_object(self, stamp: int, seen: SeenObject) -> None:
        state = None if seen.state is None else self._world.state(seen.state)
        if seen.probabilities:
            self._stream.log(stamp, f'states/{seen.name}', rr.Scalars(seen.probabilities))
        path = f'cell/objects/{seen.name}'
        if seen.shape is None:
            self._stream.log(stamp, path, rr.Clear(recursive=False))
            return
        label = f'{seen.name} {UNKNOWN if state is None else state.name}'
        if state is not None and seen.probabilities:
            label += f' {seen.probabilities[state]:.2f}'
        if not seen.visible:
            label += ' (not seen now)'
        self._stream.log(
            stamp, path, _ellipsoids([seen.shape], [state_colour(state, self._world)], [label])
        )

    def _log_table(self) -> None:
        top, thickness = self._world.table.top, self._world.table.thickness
        x, y = top.centre
        size = (top.x_max - top.x_min, top.y_max - top.y_min, thickness)
        box = rr.Boxes3D(
            centers=[(x, y, -thickness / 2)],
            sizes=[size],
            colors=[_TABLE_COLOUR],
            fill_mode='majorwireframe',
        )
        self._stream.log_static('cell/table', box)
        for number, line in enumerate(self._world.table.lines):
            ends = [(*line.start, 0.0), (*line.end, 0.0)]
            strip = rr.LineStrips3D([ends], colors=[line.colour], radii=[line.width / 2])
            self._stream.log_static(f'cell/table/line_{number}', strip)

    def _log_regions(self) -> None:
        for entry in self._world.region_entries:
            if entry.area is None:
                continue
            corners = entry.area.corners()
            outline = np.column_stack([corners, np.full(len(corners), _ABOVE)])
            strip = rr.LineStrips3D(
                [_closed(outline)],
                colors=[entry.colour],
                radii=[_LINE],
            )
            self._stream.log_static(f'cell/regions/{entry.state.name}', strip)
            # At the far end, where objects seldom are.
            spot = (entry.area.bounds.x_max, entry.area.centre[1], _ABOVE)
            name = rr.Points3D(
                [spot], colors=[entry.colour], radii=[_LINE], labels=[entry.state.name]
            )
            self._stream.log_static(f'cell/regions/{entry.state.name}/name', name)


def _closed(outline: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.vstack([outline, outline[:1]])


def _ellipsoids(
    shapes: list[Shape], colours: list[tuple[int, int, int]], labels: list[str]
) -> rr.Ellipsoids3D:
    """Bodies on the table: of the seen extents, each around the middle of its height."""
    return rr.Ellipsoids3D(
        centers=[(*s.centroid[:2], s.height / 2) for s in shapes],
        half_sizes=[
            tuple(max(size, _SMALLEST) / 2 for size in (s.length, s.width, s.height))
            for s in shapes
        ],
        quaternions=[
            rr.Quaternion(xyzw=[0.0, 0.0, np.sin(s.yaw / 2), np.cos(s.yaw / 2)]) for s in shapes
        ],
        colors=colours,
        labels=labels,
        show_labels=True,
        fill_mode='solid',
    )
