"""Lift and push, as described in the paper's section "Robot Action".

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


# Height of an empty gripper's grasp point above which it touches nothing on the table, m.
FREE_HEIGHT = 0.09
# Least length of a push in contact, m.
LEAST_PUSH = 0.05
# A centroid further than this outside the table top is not that of an object on it, m.
TABLE_MARGIN = 0.05
NOTHING_GRASPED = 'the fingers closed on nothing'
DROPPED = 'the object slipped from the fingers while it was lifted'


def place(
    motion: Motion,
    world: World,
    name: str,
    view: ObjectView,
    action: Action,
    s: PrimitiveSettings,
) -> PrimitiveResult:
    """Grasp across the minor axis above the perceived centroid, carry to the target, release."""
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
    return _carry(motion, world, name, above, action, s)


def _carry(
    motion: Motion, world: World, name: str, above: ToolPose, action: Action, s: PrimitiveSettings
) -> PrimitiveResult:
    target = action.target.name
    spot = release_pose(world, above, action, s)
    motion.move_to(spot.lifted_to(max(s.carry_height, spot.z)), s.fast)
    if not motion.holding():
        motion.open_gripper()
        motion.move_home()
        return PrimitiveResult(
            MotionOutcome.NOT_GRASPED, f'The {name} was lost on the way to {target}.'
        )
    motion.move_to(spot, s.gentle * 1.8)
    motion.open_gripper()
    motion.move_to(spot.lifted_to(max(s.clear_height, spot.z)), s.fast)
    motion.move_home()
    how = 'let fall' if action.manner.handling.fall else 'set down'
    return PrimitiveResult(MotionOutcome.COMPLETED, f'The {name} was {how} at {target}.')


def release_pose(world: World, held: ToolPose, action: Action, s: PrimitiveSettings) -> ToolPose:
    """Where a held object is released: the region's place, on the table or past its edge."""
    x, y = world.region(action.target).place
    low = s.release_height if world.table.top.contains(x, y) else s.drop_height
    return held._replace(x=x, y=y, z=action.manner.handling.fall or low)


def push(
    motion: Motion,
    look: ViewOf,
    world: World,
    name: str,
    view: ObjectView,
    target: State,
    s: PrimitiveSettings,
) -> PrimitiveResult:
    """From behind the perceived centroid, push until the perceived state becomes `target`.

    Raises:
        NoSolutionError: inverse kinematics found no solution before that.
    """
    start, end = push_line(world, view, target, s)
    motion.open_gripper(s.push_gap)
    motion.reach(start.lifted_to(s.clear_height))
    # Keep the yaw that `reach` chose: turned by pi, the same broad side pushes.
    yaw = motion.tool.yaw
    start, end = start._replace(yaw=yaw), end._replace(yaw=yaw)
    motion.move_to(start, s.gentle * 2, free=s.clear_height - FREE_HEIGHT)
    already = view.state == target

    def arrived() -> bool:
        seen = None if already else look(name)
        return seen is not None and seen.state == target

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
    world: World, view: ObjectView, target: State, s: PrimitiveSettings
) -> tuple[ToolPose, ToolPose]:
    """Start and end of the gripper's line, its broad side across the direction of the push.

    The end is where the object would lie at the region's aim; for elsewhere, where the line
    leaves the work area. The gripper may occlude the object, so seeing it in the target state
    cannot be the only end of a push.
    """
    region = world.region(target)
    heading = push_heading(region.push, view)
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


def _advanced(tool: ToolPose, end: ToolPose, distance: float) -> ToolPose:
    """A pose `distance` further towards the end of a line, at most its end."""
    rest = end.position - tool.position
    length = max(float(np.linalg.norm(rest)), 1e-9)
    x, y, _ = tool.position + rest * min(1.0, distance / length)
    return end._replace(x=float(x), y=float(y))


def execute_action(
    motion: Motion, look: ViewOf, world: World, name: str, action: Action, s: PrimitiveSettings
) -> PrimitiveResult:
    """Execute an action on an object where it is perceived now."""
    view = look(name)
    refused = check_target(world, name, view)
    if refused is not None:
        return refused
    assert view is not None, 'An object that was never seen is refused.'
    grasped = action.manner.handling.grasped
    try:
        if grasped:
            return place(motion, world, name, view, action, s)
        return push(motion, look, world, name, view, action.target, s)
    except NoSolutionError as error:
        retreat(motion, world.table, s)
        verb = action.manner.name.lower()
        reason = f'The arm does not reach far enough to {verb} the {name}. {error}'
        return PrimitiveResult(MotionOutcome.NO_IK_SOLUTION, reason)


def check_target(world: World, name: str, view: ObjectView | None) -> PrimitiveResult | None:
    """A refusal if the object cannot be acted on where it is perceived, else None."""
    if view is None:
        return PrimitiveResult(MotionOutcome.OBJECT_NOT_SEEN, f'The {name} has not been seen.')
    if view.state in world.out_of_reach:
        reason = f'The {name} is {view.state}, where the robot cannot pick it up.'
        return PrimitiveResult(MotionOutcome.OBJECT_OFFTABLE, reason)
    if view.state is None:
        return PrimitiveResult(MotionOutcome.OBJECT_NOT_SEEN, f'The {name} is occluded.')
    top = world.table.top
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
