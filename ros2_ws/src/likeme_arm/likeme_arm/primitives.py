"""Lift and push, as described in the paper's section "Robot Action".

Both use a `Motion` that is passed in, so that they can be tested with a fake and serve any arm.
They know objects only as perception reports them.
"""

from __future__ import annotations

import numpy as np

from likeme_arm.free_space import TABLE_MARGIN, FreeSpace
from likeme_arm.free_ways import FreeWays, Line, NotFreeError, Place
from likeme_arm.motion import (
    Motion,
    ObjectView,
    OthersOf,
    PrimitiveResult,
    UnsafeMotionError,
    ViewOf,
    no_others,
)
from likeme_arm.primitive_poses import PrimitiveSettings, release_pose
from likeme_arm.tool_pose import NoSolutionError, ToolPose, wrap_half_turn
from likeme_core.outcomes import MotionOutcome
from likeme_core.table import Table
from likeme_core.tabletop import Action, State
from likeme_core.world import World

# Height of an empty gripper's grasp point above which it touches nothing on the table, m.
FREE_HEIGHT = 0.09
NOTHING_GRASPED = 'the fingers closed on nothing'
DROPPED = 'the object slipped from the fingers while it was lifted'


def place(
    motion: Motion,
    world: World,
    name: str,
    view: ObjectView,
    action: Action,
    s: PrimitiveSettings,
    spot: Place,
) -> PrimitiveResult:
    """Grasp across the minor axis above the perceived centroid, carry to `spot`, release."""
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
    return _carry(motion, name, release_pose(world, above, action, s, spot), action, s)


def _carry(
    motion: Motion, name: str, spot: ToolPose, action: Action, s: PrimitiveSettings
) -> PrimitiveResult:
    target = action.target.name
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


def push(
    motion: Motion,
    look: ViewOf,
    name: str,
    view: ObjectView,
    target: State,
    s: PrimitiveSettings,
    line: Line,
) -> PrimitiveResult:
    """Along a line, from behind the object, until its perceived state becomes `target`.

    Raises:
        NoSolutionError: inverse kinematics found no solution before that.
    """
    start, end = line
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


def _advanced(tool: ToolPose, end: ToolPose, distance: float) -> ToolPose:
    """A pose `distance` further towards the end of a line, at most its end."""
    rest = end.position - tool.position
    length = max(float(np.linalg.norm(rest)), 1e-9)
    x, y, _ = tool.position + rest * min(1.0, distance / length)
    return end._replace(x=float(x), y=float(y))


def execute_action(
    motion: Motion,
    look: ViewOf,
    world: World,
    name: str,
    action: Action,
    s: PrimitiveSettings,
    others: OthersOf = no_others,
) -> PrimitiveResult:
    """Execute an action on an object where it is perceived now, clear of the `others`."""
    view = look(name)
    refused = check_target(world, name, view)
    if refused is not None:
        return refused
    assert view is not None, 'An object that was never seen is refused.'
    ways = FreeWays(motion, world, name, view, s, FreeSpace(world.table, others(name)))
    try:
        if action.manner.handling.grasped:
            return place(motion, world, name, view, action, s, ways.place(action))
        return push(motion, look, name, view, action.target, s, ways.push(action.target))
    except NotFreeError as error:
        return PrimitiveResult(MotionOutcome.NOT_FREE, str(error))
    except NoSolutionError as error:
        retreat(motion, world.table, s)
        verb = action.manner.name.lower()
        reason = f'The arm does not reach far enough to {verb} the {name}. {error}'
        return PrimitiveResult(MotionOutcome.NO_IK_SOLUTION, reason)
    except UnsafeMotionError as error:
        retreat(motion, world.table, s)
        verb = action.manner.name.lower()
        reason = f'The arm did not {verb} the {name}: a motion was not safe. {error}'
        return PrimitiveResult(MotionOutcome.FAILED, reason)


def check_names(world: World, name: str, action: int | str) -> PrimitiveResult | None:
    """A refusal if the world has no such object or action, else None."""
    if name not in world.objects:
        known = ', '.join(world.objects)
        reason = f"Expected one of {known}, got '{name}'."
        return PrimitiveResult(MotionOutcome.UNKNOWN_OBJECT, reason)
    try:
        world.action(action)
    except ValueError as error:
        return PrimitiveResult(MotionOutcome.UNKNOWN_ACTION, str(error))
    return None


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
    except (NoSolutionError, UnsafeMotionError):
        # At the limit of its reach the arm cannot follow a line, but can still move its joints.
        pass
    motion.move_home()
