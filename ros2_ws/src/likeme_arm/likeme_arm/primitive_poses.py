"""Settings of the primitives, and the poses of the gripper that follow from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from likeme_arm.motion import ObjectView
from likeme_arm.tool_pose import ToolPose, wrap_half_turn
from likeme_core.tabletop import Action, State
from likeme_core.world import World
from likeme_core.world.values import Heading, PushTarget


@dataclass(frozen=True, kw_only=True)
class PrimitiveSettings:
    """Parameters of the primitives: heights above the table and distances m, speeds m/s.

    Attributes:
        clear_height: above everything on the table.
        grasp_height, release_height: of the grasp point when the fingers close and open.
        carry_height: over the table.
        drop_height: above the table's height, past its edge.
        push_height: of the grasp point while pushing.
        push_gap: between the fingers while pushing.
        push_start: behind the perceived centroid.
        push_past: how much further, once the object is seen in the target state.
        back_off: away from the pushed object before lifting.
        fast: speed through free space.
        gentle: speed near objects.
        push_speed: speed in contact.
    """

    clear_height: float = 0.17
    grasp_height: float
    release_height: float
    carry_height: float = 0.14
    drop_height: float = 0.05
    push_height: float = 0.016
    push_gap: float
    push_start: float = 0.085
    push_past: float
    back_off: float = 0.03
    fast: float = 0.45
    gentle: float = 0.14
    push_speed: float = 0.13


# Least length of a push in contact, m.
LEAST_PUSH = 0.05


def release_pose(
    world: World,
    held: ToolPose,
    action: Action,
    s: PrimitiveSettings,
    place: tuple[float, float] | None = None,
) -> ToolPose:
    """Where a held object is released, on the table or past its edge.

    place: (x, y), m; None: the region's.
    """
    x, y = world.region(action.target).place if place is None else place
    low = s.release_height if world.table.top.contains(x, y) else s.drop_height
    return held._replace(x=x, y=y, z=action.manner.handling.fall or low)


def push_line(
    world: World,
    view: ObjectView,
    target: State,
    s: PrimitiveSettings,
    heading: Heading | None = None,
) -> tuple[ToolPose, ToolPose]:
    """Start and end of the gripper's line, its broad side across the direction of the push.

    heading: of the push; None: the one that `push_heading` chooses.

    The end is where the object would lie at the region's aim; for elsewhere, where the line
    leaves the work area. The gripper may occlude the object, so seeing it in the target state
    cannot be the only end of a push.
    """
    region = world.region(target)
    heading = heading or push_heading(region.push, view)
    along = np.array([heading.x, heading.y])
    x, y = map(float, np.array([view.x, view.y]) - s.push_start * along)
    start = ToolPose(x, y, s.push_height, wrap_half_turn(heading.yaw))
    if region.area is None:
        area = world.regions.work_area
        length = min(
            _distance(x, heading.x, area.x_min, area.x_max),
            _distance(y, heading.y, area.y_min, area.y_max),
        )
        x, y = map(float, start.position[:2] + length * along)
    else:
        begin = float(along @ start.position[:2])
        middle = float(along @ region.push.aim) - s.push_start / 2
        beside = start.position[:2] - begin * along
        x, y = map(float, beside + max(middle, begin + LEAST_PUSH) * along)
    return start, start._replace(x=x, y=y)


def push_heading(push: PushTarget, view: ObjectView) -> Heading:
    """The heading nearest to the way from an object to the aim; without any, that way."""
    x, y = push.aim[0] - view.x, push.aim[1] - view.y
    if push.headings:
        return max(push.headings, key=lambda heading: heading.x * x + heading.y * y)
    length = max(float(np.hypot(x, y)), 1e-9)
    return Heading(x / length, y / length, float(np.arctan2(y, x)))


def _distance(start: float, step: float, low: float, high: float) -> float:
    """How far one may go from `start` with `step` a metre until a border is reached, m."""
    if step == 0.0:
        return float('inf')
    return max(((high if step > 0 else low) - start) / step, 0.0)
