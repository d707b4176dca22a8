"""Place and push with a fake arm: the motions and their order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fake_motion import FakeMotion

from likeme_arm.motion import ObjectView
from likeme_arm.primitive_poses import PrimitiveSettings, push_line, release_pose
from likeme_arm.primitives import execute_action
from likeme_arm.tool_pose import ToolPose
from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import (
    LEFT,
    OFFTABLE,
    PLACE_LEFT,
    PUSH_LEFT,
    PUSH_OFFTABLE,
    PUSH_RIGHT,
    RIGHT,
    WORLD,
)
from likeme_core.tabletop import Action, Manner, State
from likeme_core.world import World
from likeme_core.world.values import Heading, PushTarget

TABLE = WORLD.table
SETTINGS = PrimitiveSettings(
    grasp_height=0.034, release_height=0.0985, push_gap=0.003, push_past=0.01,
)  # fmt: skip
RIGHT_CHICKEN = ObjectView(0.44, -0.15, 0.4, RIGHT)


def with_push(state: State, angles: tuple[float, ...]) -> World:
    """The paper's world with other headings of the pushes to one state, rad."""
    headings = tuple(Heading(float(np.cos(a)), float(np.sin(a)), a) for a in angles)
    entry = WORLD.region(state)
    changed = replace(entry, push=PushTarget(entry.push.aim, headings))
    entries = tuple(changed if e is entry else e for e in WORLD.region_entries)
    return replace(WORLD, region_entries=entries)


def run(
    motion: FakeMotion, action: Action, view: ObjectView | None = RIGHT_CHICKEN
) -> MotionOutcome:
    return execute_action(motion, lambda _: view, WORLD, 'chicken', action, SETTINGS).outcome


def test_place_grasps_across_the_minor_axis_above_the_centroid() -> None:
    motion = FakeMotion(holds=[True, True, True])
    assert run(motion, PLACE_LEFT) is MotionOutcome.COMPLETED
    above, grasp = motion.visited[:2]
    assert above[:2] == (0.44, -0.15)
    assert above.yaw == pytest.approx(0.4)
    assert grasp == above.lifted_to(SETTINGS.grasp_height)
    assert motion.log[-1] == 'home'


@pytest.mark.parametrize('holds', [[False], [True, False]], ids=['nothing', 'lost in lifting'])
def test_an_object_that_is_not_held_is_not_carried(holds: list[bool]) -> None:
    motion = FakeMotion(holds)
    assert run(motion, PLACE_LEFT) is MotionOutcome.NOT_GRASPED
    assert all(pose.y < 0.0 for pose in motion.visited)
    assert motion.log[-1] == 'home'


def test_lost_on_the_way_is_not_grasped() -> None:
    assert run(FakeMotion([True, True, False]), PLACE_LEFT) is MotionOutcome.NOT_GRASPED


@pytest.mark.parametrize('action', WORLD.actions[:3], ids=str)
@pytest.mark.parametrize('y', [-0.3, 0.1])
def test_released_where_the_state_says(action: Action, y: float) -> None:
    spot = release_pose(WORLD, ToolPose(0.5, y, 0.1, 0.0), action, SETTINGS)
    assert WORLD.regions.state_of(spot.x, spot.y) == action.target
    if action.target == OFFTABLE:
        assert not TABLE.top.contains(spot.x, spot.y)
        assert spot.y < 0.0


@pytest.mark.parametrize(
    ('target', 'direction'),
    [(LEFT, (0, 1)), (RIGHT, (0, -1)), (OFFTABLE, (1, 0))],
)
def test_push_comes_from_behind_with_the_broad_side(
    target: State, direction: tuple[int, int]
) -> None:
    start, end = push_line(with_push(OFFTABLE, (0.0,)), RIGHT_CHICKEN, target, SETTINGS)
    way = (end.position - start.position)[:2]
    assert np.allclose(way / np.linalg.norm(way), direction)
    centroid = np.array([RIGHT_CHICKEN.x, RIGHT_CHICKEN.y])
    behind = (centroid - start.position[:2]) @ direction
    assert behind == pytest.approx(SETTINGS.push_start)
    # The fingers stand apart across the hand's flat axis, which points along the push.
    assert abs(np.dot([np.cos(start.yaw), np.sin(start.yaw)], direction)) == pytest.approx(1.0)


def test_a_push_ends_with_the_object_at_the_aim_of_its_region() -> None:
    for view, target in ((RIGHT_CHICKEN, LEFT), (replace(RIGHT_CHICKEN, y=0.1), RIGHT)):
        start, end = push_line(WORLD, view, target, SETTINGS)
        way = end.position - start.position
        # Where the pushed object then lies, half the start distance before the gripper.
        lies = end.y + np.sign(way[1]) * SETTINGS.push_start / 2
        assert lies == pytest.approx(WORLD.region(target).push.aim[1])
        assert WORLD.regions.state_of(end.x, float(lies)) == target


def test_a_push_without_heading_goes_straight_to_the_aim() -> None:
    world = with_push(LEFT, ())
    start, end = push_line(world, replace(RIGHT_CHICKEN, x=0.34), LEFT, SETTINGS)
    aim = world.region(LEFT).push.aim
    way = (end.position - start.position)[:2]
    to_aim = np.array(aim) - (0.34, RIGHT_CHICKEN.y)
    assert np.allclose(way / np.linalg.norm(way), to_aim / np.linalg.norm(to_aim))
    assert start.yaw == pytest.approx(np.arctan2(to_aim[1], to_aim[0]))


def test_of_several_headings_the_one_towards_the_aim_is_taken() -> None:
    world = with_push(LEFT, (np.pi / 2, -np.pi / 2))
    for y, sign in ((-0.1, 1.0), (0.3, -1.0)):
        start, end = push_line(world, replace(RIGHT_CHICKEN, y=y), LEFT, SETTINGS)
        assert np.sign(end.y - start.y) == sign


def test_a_push_offtable_may_have_another_heading() -> None:
    world = with_push(OFFTABLE, (-0.5,))
    start, end = push_line(world, RIGHT_CHICKEN, OFFTABLE, SETTINGS)
    way = (end.position - start.position)[:2]
    assert np.arctan2(way[1], way[0]) == pytest.approx(-0.5)
    area = WORLD.regions.work_area
    assert end.x == pytest.approx(area.x_max) or end.y == pytest.approx(area.y_min)
    assert start.yaw == end.yaw == -0.5


def test_a_dropped_object_is_released_high_above_its_region() -> None:
    drop = Action(6, 'DROP_LEFT', Manner.DROP, LEFT)
    motion = FakeMotion([True, True, True])
    assert run(motion, drop) is MotionOutcome.COMPLETED
    assert max(pose.z for pose in motion.visited) == Manner.DROP.handling.fall
    low = [pose for pose in motion.visited if pose.z < SETTINGS.clear_height]
    assert all(pose.y < 0.0 for pose in low), 'It is never lowered over its target.'


def test_push_ends_a_little_after_the_seen_state_changed() -> None:
    motion = FakeMotion()
    states = iter([RIGHT, LEFT])

    def look(_: str) -> ObjectView:
        return ObjectView(0.44, -0.05, 0.0, next(states, LEFT))

    assert execute_action(motion, look, WORLD, 'pear', PUSH_LEFT, SETTINGS).outcome == 0
    start = motion.visited[1]
    furthest = max(pose.y for pose in motion.visited)
    assert furthest == pytest.approx(start.y + SETTINGS.push_past)


def test_push_of_an_occluded_object_ends_at_the_middle_of_the_area() -> None:
    motion = FakeMotion()
    views = iter([RIGHT_CHICKEN])
    occluded = ObjectView(0.44, -0.15, 0.4, None)
    execute_action(motion, lambda _: next(views, occluded), WORLD, 'chicken', PUSH_LEFT, SETTINGS)
    _, end = push_line(WORLD, RIGHT_CHICKEN, LEFT, SETTINGS)
    assert max(pose.y for pose in motion.visited) == pytest.approx(end.y)
    assert end.y < WORLD.regions.work_area.y_max / 2


def test_a_push_towards_the_present_state_is_executed() -> None:
    assert run(FakeMotion(), PUSH_RIGHT) is MotionOutcome.COMPLETED


def test_no_solution_ends_at_home() -> None:
    motion = FakeMotion(reaches=False)
    assert run(motion, PUSH_OFFTABLE) is MotionOutcome.NO_IK_SOLUTION
    assert motion.log[-1] == 'home'


@pytest.mark.parametrize(
    ('view', 'outcome'),
    [
        (None, MotionOutcome.OBJECT_NOT_SEEN),
        (ObjectView(0.44, 0.1, 0.0, None), MotionOutcome.OBJECT_NOT_SEEN),
        (ObjectView(0.44, 0.5, 0.0, OFFTABLE), MotionOutcome.OBJECT_OFFTABLE),
        (ObjectView(float('nan'), 0.1, 0.0, LEFT), MotionOutcome.OBJECT_NOT_SEEN),
        (ObjectView(0.44, 0.1, float('nan'), LEFT), MotionOutcome.OBJECT_NOT_SEEN),
        (ObjectView(4.4, 0.1, 0.0, LEFT), MotionOutcome.OBJECT_NOT_SEEN),
    ],
)
def test_an_object_that_cannot_be_acted_on_is_refused(
    view: ObjectView | None, outcome: MotionOutcome
) -> None:
    motion = FakeMotion()
    assert run(motion, PLACE_LEFT, view) is outcome
    assert motion.log == []
