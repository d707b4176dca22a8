"""Place and push with a fake arm: the motions and their order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from likeme_arm.motion import ObjectView
from likeme_arm.primitives import PrimitiveSettings, drop_spot, execute_action, push_line
from likeme_arm.tool_pose import NoSolutionError, ToolPose
from likeme_core.outcomes import MotionOutcome
from likeme_core.table import Table
from likeme_core.tabletop import Action, State

TABLE = Table()
SETTINGS = PrimitiveSettings(
    grasp_height=0.034, release_height=0.0985, place_share=0.85, push_gap=0.003, push_past=0.01,
    push_off_heading=-1.12,
)  # fmt: skip
RIGHT_CHICKEN = ObjectView(0.44, -0.15, 0.4, State.RIGHT)


class FakeMotion:
    """Records the motions and reaches every pose at once."""

    def __init__(self, holds: list[bool] | None = None, reaches: bool = True) -> None:
        self.tool = ToolPose(-0.2, -0.5, 0.2, 0.0)
        self.visited: list[ToolPose] = []
        self.log: list[str] = []
        self._holds, self._reaches = list(holds or []), reaches

    def reach(self, pose: ToolPose) -> None:
        if not self._reaches:
            raise NoSolutionError('Inverse kinematics found no solution.')
        self.log.append('reach')
        self._go(pose)

    def move_to(
        self,
        pose: ToolPose,
        speed: float,
        until: Callable[[], bool] | None = None,
        free: float = 0.0,
    ) -> bool:
        assert 0.0 < speed < 1.0
        self.log.append('move')
        if until is not None and until():
            return True
        self._go(pose)
        return False

    def move_home(self) -> None:
        self.log.append('home')

    def open_gripper(self, width: float = 0.08) -> None:
        self.log.append('open')

    def close_gripper(self) -> float:
        self.log.append('close')
        return 0.0

    def holding(self) -> bool:
        return self._holds.pop(0) if self._holds else False

    def _go(self, pose: ToolPose) -> None:
        self.tool = pose
        self.visited.append(pose)


def run(
    motion: FakeMotion, action: Action, view: ObjectView | None = RIGHT_CHICKEN
) -> MotionOutcome:
    return execute_action(motion, lambda _: view, TABLE, 'chicken', action, SETTINGS).outcome


def test_place_grasps_across_the_minor_axis_above_the_centroid() -> None:
    motion = FakeMotion(holds=[True, True, True])
    assert run(motion, Action.PLACE_LEFT) is MotionOutcome.COMPLETED
    above, grasp = motion.visited[:2]
    assert above[:2] == (0.44, -0.15)
    assert above.yaw == pytest.approx(0.4)
    assert grasp == above.lifted_to(SETTINGS.grasp_height)
    assert motion.log[-1] == 'home'


@pytest.mark.parametrize('holds', [[False], [True, False]], ids=['nothing', 'lost in lifting'])
def test_an_object_that_is_not_held_is_not_carried(holds: list[bool]) -> None:
    motion = FakeMotion(holds)
    assert run(motion, Action.PLACE_LEFT) is MotionOutcome.NOT_GRASPED
    assert all(pose.y < 0.0 for pose in motion.visited)
    assert motion.log[-1] == 'home'


def test_lost_on_the_way_is_not_grasped() -> None:
    assert run(FakeMotion([True, True, False]), Action.PLACE_LEFT) is MotionOutcome.NOT_GRASPED


@pytest.mark.parametrize('target', list(State))
@pytest.mark.parametrize('y', [-0.3, 0.1])
def test_released_where_the_state_says(target: State, y: float) -> None:
    spot = drop_spot(TABLE, ToolPose(0.5, y, 0.1, 0.0), target, SETTINGS)
    assert TABLE.state_of(spot.x, spot.y) is target
    if target is State.OFFTABLE:
        assert not TABLE.top.contains(spot.x, spot.y)
        assert spot.y < 0.0


@pytest.mark.parametrize(
    ('target', 'direction'),
    [(State.LEFT, (0, 1)), (State.RIGHT, (0, -1)), (State.OFFTABLE, (1, 0))],
)
def test_push_comes_from_behind_with_the_broad_side(
    target: State, direction: tuple[int, int]
) -> None:
    straight = replace(SETTINGS, push_off_heading=0.0)
    start, end = push_line(TABLE, RIGHT_CHICKEN, target, straight)
    way = (end.position - start.position)[:2]
    assert np.allclose(way / np.linalg.norm(way), direction)
    centroid = np.array([RIGHT_CHICKEN.x, RIGHT_CHICKEN.y])
    behind = (centroid - start.position[:2]) @ direction
    assert behind == pytest.approx(SETTINGS.push_start)
    # The fingers stand apart across the hand's flat axis, which points along the push.
    assert abs(np.dot([np.cos(start.yaw), np.sin(start.yaw)], direction)) == pytest.approx(1.0)


def test_a_push_ends_in_the_middle_of_its_area_wherever_the_blue_line_is() -> None:
    shifted = replace(TABLE, blue_line_y=-0.2)
    _, left = push_line(shifted, RIGHT_CHICKEN, State.LEFT, SETTINGS)
    # Where the pushed object then lies, half the start distance before the gripper.
    lies = left.y + SETTINGS.push_start / 2
    assert lies == pytest.approx(-0.2 + (0.33 + 0.2) * 0.45)
    assert shifted.state_of(left.x, lies) is State.LEFT
    view = replace(RIGHT_CHICKEN, y=0.1)
    _, right = push_line(shifted, view, State.RIGHT, SETTINGS)
    assert shifted.state_of(right.x, right.y - SETTINGS.push_start / 2) is State.RIGHT


def test_a_push_offtable_may_have_another_heading() -> None:
    askew = replace(SETTINGS, push_off_heading=-0.5)
    start, end = push_line(TABLE, RIGHT_CHICKEN, State.OFFTABLE, askew)
    way = (end.position - start.position)[:2]
    assert np.arctan2(way[1], way[0]) == pytest.approx(-0.5)
    area = TABLE.work_area
    assert end.x == pytest.approx(area.x_max) or end.y == pytest.approx(area.y_min)
    assert start.yaw == end.yaw == -0.5


def test_push_ends_a_little_after_the_seen_state_changed() -> None:
    motion = FakeMotion()
    states = iter([State.RIGHT, State.LEFT])

    def look(_: str) -> ObjectView:
        return ObjectView(0.44, -0.05, 0.0, next(states, State.LEFT))

    assert execute_action(motion, look, TABLE, 'pear', Action.PUSH_LEFT, SETTINGS).outcome == 0
    start = motion.visited[1]
    furthest = max(pose.y for pose in motion.visited)
    assert furthest == pytest.approx(start.y + SETTINGS.push_past)


def test_push_of_an_occluded_object_ends_at_the_middle_of_the_area() -> None:
    motion = FakeMotion()
    views = iter([RIGHT_CHICKEN])
    occluded = ObjectView(0.44, -0.15, 0.4, None)
    execute_action(
        motion, lambda _: next(views, occluded), TABLE, 'chicken', Action.PUSH_LEFT, SETTINGS
    )
    _, end = push_line(TABLE, RIGHT_CHICKEN, State.LEFT, SETTINGS)
    assert max(pose.y for pose in motion.visited) == pytest.approx(end.y)
    assert end.y < TABLE.work_area.y_max / 2


def test_a_push_towards_the_present_state_is_executed() -> None:
    assert run(FakeMotion(), Action.PUSH_RIGHT) is MotionOutcome.COMPLETED


def test_no_solution_ends_at_home() -> None:
    motion = FakeMotion(reaches=False)
    assert run(motion, Action.PUSH_OFFTABLE) is MotionOutcome.NO_IK_SOLUTION
    assert motion.log[-1] == 'home'


@pytest.mark.parametrize(
    ('view', 'outcome'),
    [
        (None, MotionOutcome.OBJECT_NOT_SEEN),
        (ObjectView(0.44, 0.1, 0.0, None), MotionOutcome.OBJECT_NOT_SEEN),
        (ObjectView(0.44, 0.5, 0.0, State.OFFTABLE), MotionOutcome.OBJECT_OFFTABLE),
        (ObjectView(float('nan'), 0.1, 0.0, State.LEFT), MotionOutcome.OBJECT_NOT_SEEN),
        (ObjectView(0.44, 0.1, float('nan'), State.LEFT), MotionOutcome.OBJECT_NOT_SEEN),
        (ObjectView(4.4, 0.1, 0.0, State.LEFT), MotionOutcome.OBJECT_NOT_SEEN),
    ],
)
def test_an_object_that_cannot_be_acted_on_is_refused(
    view: ObjectView | None, outcome: MotionOutcome
) -> None:
    motion = FakeMotion()
    assert run(motion, Action.PLACE_LEFT, view) is outcome
    assert motion.log == []
