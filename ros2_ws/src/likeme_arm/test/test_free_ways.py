"""Places and ways that are free of other objects: chosen, or refused before anything moves."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256

import numpy as np
import pytest
import shapely
from fake_motion import FakeMotion

from likeme_arm.free_space import FreeSpace, outline, radius
from likeme_arm.free_ways import BORDER, RELEASE_CLEARANCES, near_person
from likeme_arm.motion import ObjectView, PrimitiveResult
from likeme_arm.primitive_poses import PrimitiveSettings, push_line
from likeme_arm.primitives import execute_action
from likeme_arm.tool_pose import ToolPose
from likeme_core.geometry import border_distance
from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import (
    LEFT,
    OFFTABLE,
    PLACE_LEFT,
    PLACE_OFFTABLE,
    PUSH_LEFT,
    PUSH_OFFTABLE,
    RIGHT,
    WORLD,
)
from likeme_core.tabletop import Action
from likeme_core.world import load_world

SETTINGS = PrimitiveSettings(
    grasp_height=0.034, release_height=0.0985, push_gap=0.003, push_past=0.01,
)  # fmt: skip
SIZE = 0.07, 0.05, 0.05
CHICKEN = ObjectView(0.44, -0.15, 0.4, RIGHT, *SIZE)
#: The poses of all acts of the first release, to 9 digits.
ALONE = {'chung2015': '5629719d56d9fb91', 'three_bins': 'c9f852f2c63e7fd7'}


def at(x: float, y: float, height: float = 0.05) -> ObjectView:
    return ObjectView(x, y, 0.0, LEFT, 0.06, 0.05, height)


def act(motion: FakeMotion, action: Action, others: Mapping[str, ObjectView]) -> PrimitiveResult:
    return execute_action(
        motion, lambda _: CHICKEN, WORLD, 'chicken', action, SETTINGS, lambda _: others
    )


def released(others: Mapping[str, ObjectView], action: Action = PLACE_LEFT) -> ToolPose:
    motion = FakeMotion([True, True, True])
    assert act(motion, action, others).outcome is MotionOutcome.COMPLETED
    return motion.visited[-2]


def pushed(others: Mapping[str, ObjectView]) -> tuple[ToolPose, ToolPose]:
    motion = FakeMotion()
    assert act(motion, PUSH_LEFT, others).outcome is MotionOutcome.COMPLETED
    return motion.visited[1], motion.visited[2]


@pytest.mark.parametrize('name', ALONE)
def test_an_object_alone_is_moved_as_in_the_first_release(name: str) -> None:
    world, acts = load_world(name), []
    # On the floor, and beside the table: not on it.
    away = {'pear': at(0.44, -0.66), 'lemon': at(0.44, -0.40, -0.15)}
    for action in world.actions:
        for x, y, yaw, state in ((0.44, -0.15, 0.4, 'RIGHT'), (0.41, 0.17, -0.3, 'LEFT')):
            view = ObjectView(x, y, yaw, world.state(state), *SIZE)
            motion = FakeMotion([True] * 3)
            result = execute_action(
                motion, lambda _, v=view: v, world, 'chicken', action, SETTINGS, lambda _: away
            )
            poses = [[round(float(number), 9) for number in pose] for pose in motion.visited]
            acts.append([result.outcome.name, motion.log, poses])
    assert sha256(json.dumps(acts).encode()).hexdigest()[:16] == ALONE[name]


def test_a_place_that_is_taken_is_replaced_by_the_nearest_free_one() -> None:
    x, y = WORLD.region(LEFT).place
    assert released({})[:2] == (x, y)
    pear = at(x, y)
    spot = released({'pear': pear})
    room = outline(pear).distance(shapely.Point(spot.x, spot.y)) - radius(CHICKEN)
    assert RELEASE_CLEARANCES[0] <= room < RELEASE_CLEARANCES[0] + 0.03
    area = WORLD.region(LEFT).area
    assert area is not None
    assert area.contains(spot.x, spot.y)
    assert border_distance([area], spot.x, spot.y) >= BORDER - 1e-9
    assert not near_person(WORLD, spot.x, spot.y)


def test_what_is_beside_the_table_falls_where_the_edge_is_free() -> None:
    x, y = WORLD.region(OFFTABLE).place
    pear = at(x, -0.36)
    spot = released({'pear': pear}, PLACE_OFFTABLE)
    assert spot.y == y
    assert outline(pear).distance(shapely.Point(spot.x, spot.y)) > radius(CHICKEN)


def test_a_full_region_is_refused_before_anything_moves() -> None:
    others = {f'{i} {j}': at(0.3 + 0.09 * i, 0.04 + 0.09 * j) for i in range(4) for j in range(4)}
    motion = FakeMotion([True, True, True])
    result = act(motion, PLACE_LEFT, others)
    assert result.outcome is MotionOutcome.NOT_FREE
    assert not result.outcome.moved
    assert 'No place for the chicken at LEFT is free' in result.message
    assert motion.log == []


def test_places_out_of_reach_are_not_taken() -> None:
    x, y = WORLD.region(LEFT).place
    motion = FakeMotion([True, True, True], reaches=False)
    assert act(motion, PLACE_LEFT, {'pear': at(x, y)}).outcome is MotionOutcome.NOT_FREE


def test_what_is_between_the_fingers_ways_is_not_grasped() -> None:
    beside = CHICKEN.yaw + np.pi / 2
    x, y = CHICKEN.x + 0.08 * np.cos(beside), CHICKEN.y + 0.08 * np.sin(beside)
    result = act(FakeMotion(), PLACE_LEFT, {'lemon': at(float(x), float(y))})
    assert result.outcome is MotionOutcome.NOT_FREE
    assert result.message == 'The lemon is too near to the chicken to grasp it.'


def test_nothing_is_carried_over_a_tall_thing() -> None:
    assert released({'book': at(0.50, 0.04, 0.05)})[:2] == WORLD.region(LEFT).place
    bottle = at(0.50, 0.04, 0.2)
    spot = released({'bottle': bottle})
    way = shapely.LineString([(CHICKEN.x, CHICKEN.y), (spot.x, spot.y)])
    assert way.distance(outline(bottle)) > radius(CHICKEN)


def test_a_push_turns_away_from_what_is_in_its_way() -> None:
    own = push_line(WORLD, CHICKEN, LEFT, SETTINGS)
    assert [pose[:3] for pose in pushed({})] == [pose[:3] for pose in own]
    pear = at(0.50, 0.10, height=0.03)
    start, end = pushed({'pear': pear})
    assert end.x < own[1].x - 0.02
    way = shapely.LineString([(start.x, start.y), (end.x, end.y)])
    assert way.distance(outline(pear)) > radius(CHICKEN)


def test_a_push_ends_before_what_lies_at_its_end() -> None:
    start, end = pushed({'pear': at(0.44, 0.20, 0.03)})
    own = push_line(WORLD, CHICKEN, LEFT, SETTINGS)
    assert (start.x, start.y, end.x) == pytest.approx((own[0].x, own[0].y, own[1].x))
    area = WORLD.region(LEFT).area
    assert area is not None
    assert 0.0 < end.y < own[1].y
    assert border_distance([area], end.x, end.y + SIZE[1] / 2) >= BORDER


def test_a_push_off_the_table_is_turned_but_not_shortened() -> None:
    _, end = push_line(WORLD, CHICKEN, OFFTABLE, SETTINGS)
    motion = FakeMotion()
    result = act(motion, PUSH_OFFTABLE, {'pear': at(end.x + 0.07, end.y, 0.03)})
    assert result.outcome is MotionOutcome.COMPLETED
    turned = motion.visited[2]
    assert turned.yaw != pytest.approx(end.yaw)
    assert turned.y == pytest.approx(WORLD.regions.work_area.y_min)


@pytest.mark.parametrize(
    ('x', 'y', 'height'),
    [(0.44, 0.0, 0.05), (0.44, -0.26, 0.03), (0.345, -0.10, 0.06)],
    ids=['before it', 'where the gripper comes down', 'beside it, under the hand'],
)
def test_a_push_that_would_take_another_object_along_is_not_begun(
    x: float, y: float, height: float
) -> None:
    others = {'pear': at(x, y, height), 'lemon': at(2 * 0.44 - x, y, height)}
    motion = FakeMotion()
    result = act(motion, PUSH_LEFT, others)
    assert result.outcome is MotionOutcome.NOT_FREE
    assert result.message.startswith('No way to push the chicken to LEFT is free: the ')
    assert motion.log == []


def test_what_is_lower_than_the_hand_may_be_beside_a_push() -> None:
    others = {'pear': at(0.345, -0.10, 0.03), 'lemon': at(0.535, -0.10, 0.03)}
    assert act(FakeMotion(), PUSH_LEFT, others).outcome is MotionOutcome.COMPLETED


def test_an_object_of_unknown_size_is_taken_for_a_large_one() -> None:
    space = FreeSpace(WORLD.table, {'unknown object 1': ObjectView(0.4, 0.1, np.nan, None)})
    assert space.blocker(shapely.Point(0.439, 0.139), 0.08) == 'unknown object 1'
    assert space.blocker(shapely.Point(0.445, 0.1)) is None
