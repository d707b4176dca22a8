"""Forward and inverse kinematics."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_arm.tool_pose import NoSolutionError, ToolPose, wrap_half_turn
from likeme_arm_sim.kinematics import HOME, Kinematics
from likeme_core.paper_world import WORLD


@pytest.fixture(scope='module')
def kinematics() -> Kinematics:
    return Kinematics()


@pytest.mark.parametrize('yaw', [0.0, np.pi / 2])
@pytest.mark.parametrize('x', [0.27, 0.44, 0.61])
@pytest.mark.parametrize('y', [-0.33, 0.0, 0.33])
def test_every_place_of_the_work_area_can_be_reached(
    kinematics: Kinematics, x: float, y: float, yaw: float
) -> None:
    wanted = ToolPose(x, y, 0.02, yaw)
    joints = kinematics.nearest(wanted, kinematics.guess(wanted))
    reached = kinematics.tool_pose(joints)
    assert np.allclose(reached.position, wanted.position, atol=0.002)
    assert abs(wrap_half_turn(reached.yaw - yaw)) < 0.02
    assert np.all(joints >= kinematics.lower)
    assert np.all(joints <= kinematics.upper)


def test_an_error_out_of_reach_names_both_distances(kinematics: Kinematics) -> None:
    far = ToolPose(0.9, 0.4, 0.02, 0.0)
    with pytest.raises(NoSolutionError, match=r'at most 0\.010 m .* got 0\.\d+ m'):
        kinematics.nearest(far, kinematics.guess(far))


def test_home_is_beside_the_table(kinematics: Kinematics) -> None:
    tool = kinematics.tool_pose(HOME)
    assert not WORLD.table.top.contains(tool.x, tool.y)


@pytest.mark.parametrize(
    ('angle', 'axis'), [(0.3, 0.3), (2.0, 2.0 - np.pi), (-np.pi / 2, np.pi / 2), (np.pi, 0.0)]
)
def test_an_axis_is_undirected(angle: float, axis: float) -> None:
    assert wrap_half_turn(angle) == pytest.approx(axis)


def test_nothing_is_found_beyond_the_reach() -> None:
    short = Kinematics(reach=0.6)
    near = ToolPose(0.5, 0.3, 0.1, 0.0)
    assert short.tool_pose(short.nearest(near, short.guess(near))).y == pytest.approx(
        0.3, abs=0.01
    )
    far = near._replace(y=0.35)
    with pytest.raises(
        NoSolutionError, match=r'expected at most 0\.60 m from the base, got 0\.61'
    ):
        short.nearest(far, short.guess(far))
