"""Perception of a simulated cell that renders a frame only when one is needed.

The running cell's camera delivers 30 frames a second and perception reads every one. Here a frame
is rendered to see an object come to rest, and while a push waits for the object to arrive. The
perception code and the frames are the same.
"""

from __future__ import annotations

from likeme_arm.motion import ObjectView
from likeme_arm_sim.cell import Cell
from likeme_core.camera_mount import CAMERA_FRAME
from likeme_core.geometry import border_distance, distance
from likeme_core.regions import Regions
from likeme_core.tabletop import State
from likeme_perception.background import Background
from likeme_perception.catalogue import Catalogue
from likeme_perception.config import PerceptionConfig
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres

#: s between two frames: of the camera, and of an object that arm or gripper cover.
FRAME_PERIOD, COVERED_PERIOD = 1 / 30, 0.15
#: m/s. Upper bound of a pushed object's speed: twice the pusher's, as after an elastic impact.
MAX_OBJECT_SPEED = 0.26
#: s of simulated time after which a table that has not settled is taken as it is.
SETTLE_TIMEOUT = 10.0
#: s between two frames of a table that has not settled.
POLL_PERIOD = 0.2


class CellPerception:
    """Perception of one cell. It keeps its tracks: make a new one for each trial."""

    def __init__(
        self, cell: Cell, config: PerceptionConfig, known: Catalogue, background: Background | None
    ) -> None:
        """background: learned before; without it the first frames are used to learn it."""
        camera = cell.world.camera
        lens = camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height
        self._cell, self._config = cell, config
        self._perception = TabletopPerception(config, Intrinsics(*lens), known)
        self._perception.background = background
        self._table: TableObservation | None = None
        self._due, self._earliest = 0.0, 0.0
        self._expected: State | None = None

    def learn_background(self) -> Background:
        """The background of the scene at rest, from as many frames as that takes."""
        while self._perception.background is None:
            self._cell.step(FRAME_PERIOD)
            self.process_frame()
        return self._perception.background

    def wait_until_settled(self) -> TableObservation:
        """Step the cell until the table has settled, or for SETTLE_TIMEOUT."""
        table, until = self.process_frame(), self._cell.time + SETTLE_TIMEOUT
        pause = self._config.settle_time
        while not table.settled and self._cell.time < until:
            self._cell.step(pause)
            table, pause = self.process_frame(), POLL_PERIOD
        return table

    def expect_state(self, state: int) -> None:
        """Set the state a push waits for: no frame is needed before the object can be there."""
        self._expected = self._cell.world.states[state]

    def look(self, name: str) -> ObjectView | None:
        """An object as the arm receives it, from a new frame if the last one is too old."""
        table = self._table
        if table is None or self._cell.time >= self._due:
            table = self.process_frame()
            self._due = self._next_frame(table.object(name))
        return object_view(table.object(name))

    def others(self, name: str) -> dict[str, ObjectView]:
        """All objects but one as the arm receives them, as last seen."""
        table = self._table or self.process_frame()
        views = {seen.name: object_view(seen) for seen in table.objects if seen.name != name}
        return {other: view for other, view in views.items() if view is not None}

    def process_frame(self) -> TableObservation:
        """Render a frame and process it."""
        images = self._cell.frame()
        stamp, depth = round(self._cell.time * 1e9), depth_in_metres(images.depth_mm)
        self._table = self._perception.process(RgbdFrame(stamp, CAMERA_FRAME, images.rgb, depth))
        self._due = self._cell.time + FRAME_PERIOD
        return self._table

    def _next_frame(self, seen: ObjectObservation) -> float:
        """Cell time, s, before which the object cannot reach the expected state."""
        regions, now = self._perception.regions, self._cell.time
        if regions is None or seen.shape is None:
            return now + COVERED_PERIOD
        if seen.state is not None:
            distance = distance_to_state(regions, *seen.centroid[:2], self._expected)
            self._earliest = now + distance / MAX_OBJECT_SPEED
            return max(self._earliest, now + FRAME_PERIOD)
        return max(self._earliest, now + COVERED_PERIOD)


def distance_to_state(regions: Regions, x: float, y: float, state: State | None) -> float:
    """Distance of (x, y) to where the state becomes `state` (None: any other state), m."""
    here = regions.state_of(x, y)
    areas = [area for area in regions.areas if area is not None]
    if here == regions.elsewhere:
        # From beside the areas, the border of one of them is crossed first.
        return min(distance(area, x, y) for area in areas)
    if state == regions.elsewhere:
        return border_distance(areas, x, y)
    own = regions.areas[here]
    target = None if state is None else regions.areas[state]
    assert own is not None, 'Only elsewhere has no area.'
    return border_distance([own], x, y) if target is None else distance(target, x, y)


def object_view(seen: ObjectObservation) -> ObjectView | None:
    """An observed object as the arm receives it; None when it was never seen."""
    if seen.shape is None:
        return None
    (x, y, _), shape = seen.centroid, seen.shape
    return ObjectView(x, y, shape.yaw, seen.state, shape.length, shape.width, shape.height)
