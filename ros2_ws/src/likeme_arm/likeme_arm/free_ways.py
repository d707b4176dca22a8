"""Places and ways that are free of other objects, and of where the person is.

The world's own place and heading come first, so that an object alone on the table is moved as if
there were no choice. Clearances are those of the simulated arm and its objects, chosen on acts of
which it is known whether they moved another object.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely

from likeme_arm.free_space import FreeSpace, least_radius, radius
from likeme_arm.motion import OPEN_WIDTH, Motion, ObjectView
from likeme_arm.primitive_poses import (
    LEAST_PUSH,
    PrimitiveSettings,
    push_heading,
    push_line,
    release_pose,
)
from likeme_arm.tool_pose import ToolPose, Vector, wrap_half_turn
from likeme_core.geometry import Area, border_distance
from likeme_core.tabletop import Action, State
from likeme_core.world import World
from likeme_core.world.values import Heading, RegionEntry

Place = tuple[float, float]
Line = tuple[ToolPose, ToolPose]

#: Around the gripper, beside a pushed object, and beyond the end of its way, m.
GRIPPER_CLEARANCE, PUSH_CLEARANCE, ROLL = 0.005, 0.01, 0.01
#: Around an object that is released over a place, m; it bounces and rolls. The second is for
#: tables on which no place has the first.
RELEASE_CLEARANCES = 0.05, 0.025
#: Of other places: distance from one to the next, and from the border of the region, m.
SPACING, BORDER = 0.02, 0.04
#: Between two ends of a push that are tried, m.
STEP = 0.01
#: Greatest way along the table's edge of a place beside the table, m.
ALONG_EDGE = 0.2
#: Other headings of a push: the world's turned by these, rad.
TURNS = tuple(sign * turn for turn in (0.15, 0.3, 0.45, 0.6) for sign in (1, -1))
#: Width of the strip of the table at a person's side in which no other place is chosen, m.
PERSON_STRIP = 0.10


class NotFreeError(Exception):
    """Nothing is free that the action needs; says what is in the way."""


class FreeWays:
    """The free places and ways for one object, from where it is perceived."""

    def __init__(
        self,
        motion: Motion,
        world: World,
        name: str,
        view: ObjectView,
        s: PrimitiveSettings,
        space: FreeSpace,
    ) -> None:
        """motion: tells what is within reach; nothing moves. space: without the object itself."""
        self._motion, self._world, self._s, self._space = motion, world, s, space
        self._name, self._view = name, view
        self._radius, self._least_radius = radius(view), least_radius(view)

    def place(self, action: Action) -> Place:
        """Where to release the object: the region's place, or the free one nearest to it.

        Raises:
            NotFreeError: it cannot be grasped, or no place or no way to one is free.
        """
        world, region = self._world, self._world.region(action.target)
        if self._space.empty:
            return region.place
        view, s = self._view, self._s
        grasp = ToolPose(view.x, view.y, s.grasp_height, wrap_half_turn(view.yaw))
        near = self._space.gripper_blocker(grasp, grasp, OPEN_WIDTH, GRIPPER_CLEARANCE)
        if near is not None:
            raise NotFreeError(f'The {near} is too near to the {self._name} to grasp it.')
        in_the_way = None
        for around in RELEASE_CLEARANCES:
            for place in _places(world, region):
                released = release_pose(world, grasp, action, s, place)
                blocker = self._carry_blocker(grasp, released, around)
                reached = place == region.place or self._motion.reachable(released)
                if blocker is None and reached:
                    return place
                in_the_way = in_the_way or blocker
        raise NotFreeError(
            f'No place for the {self._name} at {region.state.name} is free and within reach: the '
            f'{in_the_way} is in the way.'
        )

    def push(self, target: State) -> Line:
        """Start and end of the gripper's line: by the world's heading, or the nearest free one.

        Raises:
            NotFreeError: on each of them something is in the way.
        """
        world, view, s = self._world, self._view, self._s
        own = push_heading(world.region(target).push, view)
        line = push_line(world, view, target, s, own)
        if self._space.empty:
            return line
        blocker = self._push_blocker(line)
        if blocker is None:
            return line
        for heading in (own, *_other_headings(world, target, own)):
            whole = push_line(world, view, target, s, heading)
            for other in (whole, self._shortened(target, whole)):
                if (
                    self._ends_well(target, other)
                    and self._push_blocker(other) is None
                    and all(
                        map(self._motion.reachable, (other[0].lifted_to(s.clear_height), *other))
                    )
                ):
                    return other
        raise NotFreeError(
            f'No way to push the {self._name} to {target.name} is free: the {blocker} is in it.'
        )

    def _carry_blocker(self, grasp: ToolPose, released: ToolPose, around: float) -> str | None:
        # What is let fall beside the table does not come back.
        over = self._world.table.top.contains(released.x, released.y)
        room = self._radius + (around if over else GRIPPER_CLEARANCE)
        carried = shapely.LineString([grasp[:2], released[:2]])
        # What is held hangs below the grasp point by the height at which it was grasped.
        low = self._s.carry_height - self._s.grasp_height
        return (
            self._space.blocker(shapely.Point(released[:2]).buffer(room))
            or self._space.blocker(carried.buffer(self._radius + GRIPPER_CLEARANCE), low)
            or self._space.gripper_blocker(released, released, OPEN_WIDTH, GRIPPER_CLEARANCE)
        )

    def _push_blocker(self, line: Line) -> str | None:
        start, end = line
        here = np.array([self._view.x, self._view.y])
        pushed = shapely.LineString([here, self._pushed_to(line, self._radius + ROLL)])
        return self._space.blocker(
            pushed.buffer(self._radius + PUSH_CLEARANCE)
        ) or self._space.gripper_blocker(start, end, self._s.push_gap, GRIPPER_CLEARANCE)

    def _pushed_to(self, line: Line, ahead: float) -> Vector:
        """Where something is that is `ahead` m of the gripper at the end of a line, (2,)."""
        way = (line[1].position - line[0].position)[:2]
        return np.asarray(line[1].position[:2] + ahead / max(float(np.hypot(*way)), 1e-9) * way)

    def _shortened(self, target: State, line: Line) -> Line:
        """The line up to where the object is well inside its region, not at the aim."""
        start, end = line
        if self._world.region(target).area is None:
            return line
        way = end.position - start.position
        length = float(np.linalg.norm(way))
        for reach in np.arange(LEAST_PUSH, length, STEP):
            x, y, _ = map(float, start.position + reach / length * way)
            shorter = start, end._replace(x=x, y=y)
            if self._ends_well(target, shorter):
                return shorter
        return line

    def _ends_well(self, target: State, line: Line) -> bool:
        """Whether a push would end well inside its region, and not near a person."""
        area = self._world.region(target).area
        # At least so far ahead of the gripper is its centre, however it turned.
        x, y = map(float, self._pushed_to(line, self._least_radius))
        if near_person(self._world, x, y):
            return False
        if area is None:
            return True
        return bool(area.contains(x, y)) and border_distance([area], x, y) >= BORDER


def near_person(world: World, x: float, y: float) -> bool:
    """Whether a point is over the strip of the table in front of a person, or beyond it."""
    top = world.table.top
    depth = {
        'far': top.x_max - x, 'near': x - top.x_min, 'left': top.y_max - y, 'right': y - top.y_min,
    }  # fmt: skip
    return any(depth[side] < PERSON_STRIP for side in world.person_sides)


def _places(world: World, region: RegionEntry) -> Iterator[Place]:
    """The region's place, then others in it, nearest first."""
    yield region.place
    x, y = region.place
    found = _along_edge(world, region.place) if region.area is None else _inside(region.area)
    free = [place for place in found if not near_person(world, *place)]
    yield from sorted(free, key=lambda place: np.hypot(place[0] - x, place[1] - y))


def _inside(area: Area) -> list[Place]:
    """Places on a grid, well inside an area."""
    box = area.bounds
    return [
        (float(x), float(y))
        for x in np.arange(box.x_min + BORDER, box.x_max - BORDER, SPACING)
        for y in np.arange(box.y_min + BORDER, box.y_max - BORDER, SPACING)
        if area.contains(x, y) and border_distance([area], x, y) >= BORDER
    ]


def _along_edge(world: World, place: Place) -> list[Place]:
    """Places as far past the table's edge as `place`."""
    (x, y), top = place, world.table.top
    steps = np.arange(SPACING, ALONG_EDGE, SPACING)
    shifts = [float(shift) for step in steps for shift in (-step, step)]
    past_side = not top.y_min <= y <= top.y_max
    shifted = [(x + shift, y) if past_side else (x, y + shift) for shift in shifts]
    return [each for each in shifted if not top.contains(*each)]


def _other_headings(world: World, target: State, own: Heading) -> Iterator[Heading]:
    """Headings to a region but `own`: those of the world, then `own` turned."""
    yield from (heading for heading in world.region(target).push.headings if heading != own)
    for turn in TURNS:
        yaw = own.yaw + turn
        yield Heading(float(np.cos(yaw)), float(np.sin(yaw)), yaw)
