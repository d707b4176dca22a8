"""A simulated cell under the eyes of perception, a frame whenever somebody looks.

In the running cell the camera delivers 30 frames a second and perception reads every one. Here a
frame is drawn when it is needed: to see an object come to rest, and while a push asks whether it
has arrived. What is decided is decided by the same code on the same kind of frames.
"""

from __future__ import annotations

from likeme_arm.motion import ObjectView
from likeme_arm_sim import scene as sim
from likeme_arm_sim.cell import Cell
from likeme_core.regions import Regions
from likeme_core.tabletop import State
from likeme_perception.background import Background
from likeme_perception.config import PerceptionConfig
from likeme_perception.identification import Catalogue
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres

#: s between two frames: of the camera, and of an object that arm or gripper cover.
SHORTEST, COVERED = 1 / 30, 0.15
#: m/s. No pushed object comes nearer to a border faster than this: what bounces off the pusher
#: without loss has twice its speed.
FASTEST = 0.26
#: s of simulated time after which what does not come to rest is taken as it is.
PATIENCE = 10.0
#: s between looks at what has not come to rest yet.
GLANCE = 0.2


class Eyes:
    """Perception of one cell from a known background on; forgets nothing, so make new ones."""

    def __init__(
        self, cell: Cell, config: PerceptionConfig, known: Catalogue, background: Background | None
    ) -> None:
        """background: learned before; without it the first frames are spent on it."""
        camera = cell.scene.camera
        lens = camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height
        self._cell, self._config = cell, config
        self._perception = TabletopPerception(config, Intrinsics(*lens), known)
        self._perception.background = background
        self._table: TableObservation | None = None
        self._due, self._earliest = 0.0, 0.0
        self._awaited: State | None = None

    def learn_background(self) -> Background:
        """What the camera sees of the scene that stands still, from as many frames as it takes."""
        while self._perception.background is None:
            self._cell.step(SHORTEST)
            self.see()
        return self._perception.background

    def at_rest(self) -> TableObservation:
        """Let time pass until the camera sees the whole table at rest, or for long enough."""
        table, until = self.see(), self._cell.time + PATIENCE
        pause = self._config.settle_time
        while not table.settled and self._cell.time < until:
            self._cell.step(pause)
            table, pause = self.see(), GLANCE
        return table

    def look_out_for(self, state: int) -> None:
        """What a push waits for: until an object can be there, it need not be looked at."""
        self._awaited = State(state)

    def look(self, name: str) -> ObjectView | None:
        """What the arm is told about an object: a new frame where the last one is too old."""
        table = self._table
        if table is None or self._cell.time >= self._due:
            table = self.see()
            self._due = self._next(table.object(name))
        return object_view(table.object(name))

    def see(self) -> TableObservation:
        """A new frame, read."""
        images = self._cell.frame()
        stamp, depth = round(self._cell.time * 1e9), depth_in_metres(images.depth_mm)
        self._table = self._perception.process(
            RgbdFrame(stamp, sim.CAMERA_FRAME, images.rgb, depth)
        )
        self._due = self._cell.time + SHORTEST
        return self._table

    def _next(self, seen: ObjectObservation) -> float:
        """When to look again, on the cell's clock, s: before it cannot be where it is awaited."""
        regions, now = self._perception.regions, self._cell.time
        if regions is None or seen.shape is None:
            return now + COVERED
        if seen.state is not None:
            away = distance_to_state(regions, *seen.centroid[:2], self._awaited)
            self._earliest = now + away / FASTEST
            return max(self._earliest, now + SHORTEST)
        return max(self._earliest, now + COVERED)


def distance_to_state(regions: Regions, x: float, y: float, state: State | None) -> float:
    """How far a place is from where the state becomes `state` (None: another one), m."""
    area, line = regions.work_area, regions.blue_line_y
    sides = min(abs(x - area.x_min), abs(area.x_max - x), abs(y - area.y_min), abs(area.y_max - y))
    if state is State.OFFTABLE:
        return sides
    # Who lies beside the area crosses one of its sides first.
    outside = regions.state_of(x, y) is State.OFFTABLE
    return min(sides, abs(y - line)) if state is None or outside else abs(y - line)


def object_view(seen: ObjectObservation) -> ObjectView | None:
    """An object as the arm is told of it; None when it was never seen."""
    if seen.shape is None:
        return None
    x, y, _ = seen.centroid
    return ObjectView(x, y, seen.shape.yaw, seen.state)
