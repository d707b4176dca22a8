"""The simulated arm: lines, grasps, occlusion of the table."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_arm.tool_pose import NoSolutionError, ToolPose
from likeme_arm_sim.arm import Arm
from likeme_arm_sim.joint_path import trapezoidal_profile
from likeme_arm_sim.kinematics import Kinematics
from likeme_arm_sim.panda_meshes import panda_links
from likeme_arm_sim.physics_world import STEP_RATE, PhysicsWorld
from likeme_arm_sim.toys import toys_of
from likeme_core.paper_world import WORLD

TOYS = toys_of(WORLD)


@pytest.fixture
def world() -> PhysicsWorld:
    return PhysicsWorld(WORLD.table, TOYS)


@pytest.fixture
def arm(world: PhysicsWorld) -> Arm:
    return Arm(world.client, Kinematics(), world.step)


def test_the_arm_at_home_does_not_occlude_the_table(arm: Arm) -> None:
    scene = WORLD
    eye = np.asarray(scene.camera.position)
    poses = arm.link_poses()
    for name, mesh in panda_links().items():
        points = mesh.transformed(poses[name].matrix()).vertices
        below = points[points[:, 2] < eye[2] - 0.05]
        # Where the ray from the camera through each point of the arm meets the table's plane.
        share = eye[2] / (eye[2] - below[:, 2])
        shadow = eye + (below - eye) * share[:, None]
        top = scene.table.top
        covered = [top.contains(x, y) for x, y, z in shadow]
        assert not any(covered), name


def test_lines_end_where_they_should_at_their_speed(world: PhysicsWorld, arm: Arm) -> None:
    arm.reach(ToolPose(0.44, -0.2, 0.1, np.pi / 2))
    start, began = arm.tool, world.time
    arm.move_to(start._replace(y=0.2), speed=0.2)
    assert np.allclose(arm.tool.position, [0.44, 0.2, 0.1], atol=0.005)
    assert 2.0 < world.time - began < 2.6


def test_a_line_out_of_reach_is_followed_as_far_as_it_goes(arm: Arm) -> None:
    arm.reach(ToolPose(0.5, 0.0, 0.1, 0.0))
    with pytest.raises(NoSolutionError):
        arm.move_to(arm.tool._replace(x=1.1), speed=0.4)
    assert arm.tool.x > 0.65


def test_until_stops_a_line(arm: Arm) -> None:
    arm.reach(ToolPose(0.44, -0.2, 0.1, np.pi / 2))
    assert arm.move_to(arm.tool._replace(y=0.2), 0.3, until=lambda: arm.tool.y > 0.0)
    assert abs(arm.tool.y) < 0.03


def test_friction_alone_lifts_a_toy(world: PhysicsWorld, arm: Arm) -> None:
    world.put_toy('chicken', 0.44, 0.1, 0.0, 0.0)
    arm.open_gripper()
    arm.reach(ToolPose(0.44, 0.1, 0.17, 0.0))
    arm.move_to(arm.tool.lifted_to(0.018), 0.3)
    width = arm.close_gripper()
    arm.move_to(arm.tool.lifted_to(0.17), 0.3)
    assert arm.holding()
    assert width == pytest.approx(TOYS['chicken'].size[1], abs=0.015)
    assert world.toy_pose('chicken').position[2] > 0.12
    arm.open_gripper()
    arm.wait(0.5)
    assert world.toy_pose('chicken').position[2] < 0.05
    assert not arm.holding()


def test_closing_on_nothing_is_noticed(arm: Arm) -> None:
    arm.close_gripper()
    assert not arm.holding()


def test_skip_free_space_jumps_over_the_free_part_of_a_line(world: PhysicsWorld, arm: Arm) -> None:
    arm.skip_free_space = True
    above = ToolPose(0.44, -0.1, 0.17, 0.3)
    took, ends = [], []
    for free in (0.0, 0.08, 1.0):
        arm.reach(above)
        began = world.time
        arm.move_to(above.lifted_to(0.03), 0.25, free=free)
        took.append(world.time - began)
        ends.append(arm.tool)
    assert took[2] < took[1] < took[0] - 0.2
    for end in ends:
        assert end.position == pytest.approx([0.44, -0.1, 0.03], abs=0.003)


def test_by_default_the_free_part_of_a_line_is_followed(world: PhysicsWorld, arm: Arm) -> None:
    arm.reach(ToolPose(0.44, -0.1, 0.17, 0.3))
    began = world.time
    arm.move_to(ToolPose(0.44, -0.1, 0.03, 0.3), 0.25, free=0.14)
    assert world.time - began > 0.14 / 0.25


def test_skip_free_space_does_not_wait_for_open_fingers(world: PhysicsWorld, arm: Arm) -> None:
    began = world.time
    arm.open_gripper()
    assert world.time > began
    arm.skip_free_space = True
    began = world.time
    arm.open_gripper()
    assert world.time == began
    arm.open_gripper(0.02)
    assert world.time > began


def test_the_speed_profile_is_smooth_and_complete() -> None:
    distance = trapezoidal_profile(0.4, 0.2, 1.0)
    speed = np.diff(distance) * STEP_RATE
    assert distance[-1] == pytest.approx(0.4)
    assert speed.min() >= 0.0
    assert speed.max() < 0.21
    assert np.abs(np.diff(speed)).max() < 0.01
