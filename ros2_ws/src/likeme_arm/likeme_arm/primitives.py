"""Place and push, as described in the paper's section "Robot Action".

Both use a `Motion` that is passed in, so that they can be tested with a fake and serve any arm.
They know objects only as perception reports them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from likeme_arm.motion import Motion, ObjectView, PrimitiveResult, ViewOf
from likeme_arm.tool_pose import NoSolutionError, ToolPose, wrap_half_turn
from likeme_core.outcomes import MotionOutcome
from likeme_core.table import Table
from likeme_core.tabletop import Action, Manner, State


@dataclass(frozen=True, kw_only=True)
class PrimitiveSettings:
    """Parameters of the primitives: heights above the table and distances m, speeds m/s.

    Attributes:
        clear_height: above everything on the table.
        grasp_height, release_height: of the grasp point when the fingers close and open.
        carry_height: over the table.
        drop_height: above the table's height, past its edge.
        drop_x, beyond_edge: where OFFTABLE is: x along the right edge, and how far past it.
        place_share: where LEFT and RIGHT are, from the blue line (0) to the area's border (1).
        push_height: of the grasp point while pushing.
        push_gap: between the fingers while pushing.
        push_start: behind the perceived centroid.
        push_past: how much further, once the object is seen in the target state.
        push_off_heading: direction of a push OFFTABLE, rad from +x: over the far edge (0) or
            towards the right-hand corner (negative).
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
    drop_x: float = 0.34
    beyond_edge: float = 0.06
    place_share: float
    push_height: float = 0.016
    push_gap: float
    push_start: float = 0.085
    push_past: float
    push_off_heading: float
    back_off: float = 0.03
    fast: float = 0.45
    gentle: float = 0.14
    push_speed: float = 0.13


# Height of an empty gripper's grasp point above which it touches nothing on the table, m.
FREE_HEIGHT = 0.09
# A centroid further than this outside the table top is not that of an object on it, m.
TABLE_MARGIN = 0.05
NOTHING_GRASPED = 'the fingers closed on nothing'
DROPPED = 'the object slipped from the fingers while it was lifted'


def place(
    motion: Motion, table: Table, name: str, view: ObjectView, target: State, s: PrimitiveSettings
) -> PrimitiveResult:
    """Grasp across the minor axis above the perceived centroid, and carry to `target`."""
    above = ToolPose(view.x, view.y, s.clear_height, wrap_half_turn(view.yaw))
    motion.open_gripper()
    motion.reach(above)
    # `reach` may have turned the hand by pi, which grasps equally well.
    above = above._replace(yaw=motion.tool.yaw)
    free = s.clear_height - FREE_HEIGHT
    motion.move_to(above.lifted_to(s.grasp_height), s.gentle * 1.8, free=free)
    motion.close_gripper()
    grasped = motion.holding()
    motion.move_to(above, s.gentle * 2)
    if not (grasped and motion.holding()):
        motion.open_gripper()
        motion.move_home()
        reason = DROPPED if grasped else NOTHING_GRASPED
        return PrimitiveResult(MotionOutcome.NOT_GRASPED, f'The {name} was not grasped: {reason}.')
    return _carry(motion, table, name, above, target, s)


def _carry(
    motion: Motion, table: Table, name: str, above: ToolPose, target: State, s: PrimitiveSettings
) -> PrimitiveResult:
    spot = drop_spot(table, above, target, s)
    motion.move_to(spot.lifted_to(s.carry_height), s.fast)
    if not motion.holding():
        motion.open_gripper()
        motion.move_home()
        return PrimitiveResult(
            MotionOutcome.NOT_GRASPED, f'The {name} was lost on the way to {target.name}.'
        )
    motion.move_to(spot, s.gentle * 1.8)
    motion.open_gripper()
    motion.move_to(spot.lifted_to(s.clear_height), s.fast)
    motion.move_home()
    return PrimitiveResult(MotionOutcome.COMPLETED, f'The {name} was set down at {target.name}.')


def drop_spot(table: Table, held: ToolPose, target: State, s: PrimitiveSettings) -> ToolPose:
    """Where a held object is released: a fixed point of the area; OFFTABLE past the right edge."""
    area, top = table.work_area, table.top
    if target is State.OFFTABLE:
        return held._replace(x=s.drop_x, y=top.y_min - s.beyond_edge, z=s.drop_height)
    border = area.y_max if target is State.LEFT else area.y_min
    line = table.blue_line_y
    y = line + (border - line) * s.place_share
    return held._replace(x=area.centre[0], y=y, z=s.release_height)


def push(
    motion: Motion,
    look: ViewOf,
    table: Table,
    name: str,
    view: ObjectView,
    target: State,
    s: PrimitiveSettings,
) -> PrimitiveResult:
    """From behind the perceived centroid, push until the perceived state becomes `target`.

    Raises:
        NoSolutionError: inverse kinematics found no solution before that.
    """
    start, end = push_line(table, view, target, s)
    motion.open_gripper(s.push_gap)
    motion.reach(start.lifted_to(s.clear_height))
    # Keep the yaw that `reach` chose: turned by pi, the same broad side pushes.
    yaw = motion.tool.yaw
    start, end = start._replace(yaw=yaw), end._replace(yaw=yaw)
    motion.move_to(start, s.gentle * 2, free=s.clear_height - FREE_HEIGHT)
    already = view.state is target

    def arrived() -> bool:
        seen = None if already else look(name)
        return seen is not None and seen.state is target

    stopped = motion.move_to(end, s.push_speed, until=arrived)
    if stopped:
        motion.move_to(_advanced(motion.tool, end, s.push_past), s.push_speed)
    # Lifting straight up would drag a round object along: move back first.
    motion.move_to(_advanced(motion.tool, start, s.back_off), s.gentle)
    motion.move_to(motion.tool.lifted_to(s.clear_height), s.fast, free=s.clear_height)
    motion.move_home()
    until = (
        'until it was seen there'
        if stopped
        else 'to the end of the line, without being seen there'
    )
    return PrimitiveResult(
        MotionOutcome.COMPLETED, f'The {name} was pushed towards {target.name}, {until}.'
    )


def push_line(
    table: Table, view: ObjectView, target: State, s: PrimitiveSettings
) -> tuple[ToolPose, ToolPose]:
    """Start and end of the gripper's line, its broad side across the direction of the push.

    The end is where the object would lie in the middle of the target area (just over the far edge
    for OFFTABLE). The gripper may occlude the object, so seeing it in the target state cannot be
    the only end of a push.
    """
    area = table.work_area
    if target is State.OFFTABLE:
        along = np.array([np.cos(s.push_off_heading), np.sin(s.push_off_heading)])
        x, y = map(float, np.array([view.x, view.y]) - s.push_start * along)
        start = ToolPose(x, y, s.push_height, s.push_off_heading)
        far = max((area.x_max - x) / along[0], 0.0)
        side = max((area.y_min - y) / along[1], 0.0) if along[1] < 0.0 else np.inf
        x, y = map(float, start.position[:2] + min(far, side) * along)
        return start, start._replace(x=x, y=y)
    sign, border = (1.0, area.y_max) if target is State.LEFT else (-1.0, area.y_min)
    start = ToolPose(view.x, view.y - sign * s.push_start, s.push_height, np.pi / 2)
    middle = table.blue_line_y + (border - table.blue_line_y) * 0.45 - sign * s.push_start / 2
    y = max(middle, start.y + 0.05) if sign > 0 else min(middle, start.y - 0.05)
    return start, start._replace(y=y)


def _advanced(tool: ToolPose, end: ToolPose, distance: float) -> ToolPose:
    """A pose `distance` further towards the end of a line, at most its end."""
    rest = end.position - tool.position
    length = max(float(np.linalg.norm(rest)), 1e-9)
    x, y, _ = tool.position + rest * min(1.0, distance / length)
    return end._replace(x=float(x), y=float(y))


def execute_action(
    motion: Motion, look: ViewOf, table: Table, name: str, action: Action, s: PrimitiveSettings
) -> PrimitiveResult:
    """Execute one of the six actions on an object where it is perceived now."""
    view = look(name)
    refused = check_target(table, name, view)
    if refused is not None:
        return refused
    assert view is not None, 'An object that was never seen is refused.'
    try:
        if action.manner is Manner.PUSH:
            return push(motion, look, table, name, view, action.target, s)
        return place(motion, table, name, view, action.target, s)
    except NoSolutionError as error:
        retreat(motion, table, s)
        verb = 'push' if action.manner is Manner.PUSH else 'place'
        reason = f'The arm does not reach far enough to {verb} the {name}. {error}'
        return PrimitiveResult(MotionOutcome.NO_IK_SOLUTION, reason)


def check_target(table: Table, name: str, view: ObjectView | None) -> PrimitiveResult | None:
    """A refusal if the object cannot be acted on where it is perceived, else None."""
    if view is None:
        return PrimitiveResult(MotionOutcome.OBJECT_NOT_SEEN, f'The {name} has not been seen.')
    if view.state is State.OFFTABLE:
        reason = f'The {name} is OFFTABLE, where the robot cannot pick it up.'
        return PrimitiveResult(MotionOutcome.OBJECT_OFFTABLE, reason)
    if view.state is None:
        return PrimitiveResult(MotionOutcome.OBJECT_NOT_SEEN, f'The {name} is occluded.')
    top = table.top
    # NaN fails every comparison, so it is refused, too.
    inside_x = top.x_min - TABLE_MARGIN <= view.x <= top.x_max + TABLE_MARGIN
    inside_y = top.y_min - TABLE_MARGIN <= view.y <= top.y_max + TABLE_MARGIN
    if not (inside_x and inside_y and np.isfinite(view.yaw)):
        reason = (
            f'Expected the {name} over the table, x {top.x_min:.2f} to {top.x_max:.2f} and '
            f'y {top.y_min:.2f} to {top.y_max:.2f} m, got x {view.x:.2f}, y {view.y:.2f}, '
            f'yaw {view.yaw:.2f}.'
        )
        return PrimitiveResult(MotionOutcome.OBJECT_NOT_SEEN, reason)
    return None


def retreat(motion: Motion, table: Table, s: PrimitiveSettings) -> None:
    """Set down what the arm holds, lift it and move home, from wherever it was stopped."""
    here = motion.tool
    try:
        if motion.holding() and table.top.contains(here.x, here.y):
            motion.move_to(here.lifted_to(min(here.z, s.release_height)), s.gentle)
        motion.open_gripper()
        here = motion.tool
        # A little towards the base: at the limit of its reach the arm cannot move straight up.
        back = here._replace(x=0.98 * here.x, y=0.98 * here.y)
        motion.move_to(back.lifted_to(max(here.z, s.clear_height)), s.gentle * 2)
    except NoSolutionError:
        # At the limit of its reach the arm cannot follow a line, but can still move its joints.
        pass
    motion.move_home()
