"""Calibration error and play of the arm."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_arm.tool_pose import ToolPose
from likeme_arm_sim.calibration_error import MiscalibratedMotion, draw_calibration_offset
from likeme_arm_sim.physics import ArmAccuracy

OFFSET = ToolPose(0.01, -0.02, 0.003, 0.1)
GOAL = ToolPose(0.4, 0.1, 0.2, 0.5)


class Recorder:
    """Goes where it is told; nothing else is asked of it here."""

    def __init__(self) -> None:
        self.tool = ToolPose(0.0, 0.0, 0.0, 0.0)

    def reach(self, pose: ToolPose) -> None:
        self.tool = pose

    def move_to(
        self, pose: ToolPose, speed: float, until: object = None, free: float = 0.0
    ) -> bool:
        self.tool = pose
        return until is not None


@pytest.mark.parametrize('how', ['reach', 'line'])
def test_the_true_pose_is_displaced_from_the_assumed_one(how: str) -> None:
    true = Recorder()
    believed = MiscalibratedMotion(true, OFFSET)  # type: ignore[arg-type]
    if how == 'reach':
        believed.reach(GOAL)
    else:
        assert not believed.move_to(GOAL, 0.1)
    assert true.tool == pytest.approx((0.41, 0.08, 0.203, 0.6))
    assert believed.tool == pytest.approx(GOAL)


def test_a_skewed_calibration_rotates_about_the_middle() -> None:
    true, centre = Recorder(), (0.44, 0.0)
    still = ToolPose(0.0, 0.0, 0.0, 0.0)
    believed = MiscalibratedMotion(true, still, 0.1, centre)  # type: ignore[arg-type]
    believed.reach(ToolPose(0.44, 0.0, 0.2, 0.5))
    assert true.tool == pytest.approx((0.44, 0.0, 0.2, 0.6))
    believed.reach(ToolPose(0.44, 0.17, 0.2, 0.5))
    assert true.tool == pytest.approx((0.44 - 0.01697, 0.16915, 0.2, 0.6), abs=1e-4)
    assert believed.tool == pytest.approx((0.44, 0.17, 0.2, 0.5))


def test_offsets_have_the_named_bias_and_spread() -> None:
    accuracy = ArmAccuracy(bias_x=0.005, bias_y=-0.004, noise=0.006, noise_z=0.002, turn=0.1)
    rng = np.random.default_rng(1)
    offsets = np.array([draw_calibration_offset(accuracy, rng) for _ in range(4000)])
    assert offsets.mean(axis=0) == pytest.approx([0.005, -0.004, 0.0, 0.0], abs=0.006)
    assert offsets[:, :2].mean(axis=0) == pytest.approx([0.005, -0.004], abs=0.0004)
    assert offsets.std(axis=0) == pytest.approx([0.006, 0.006, 0.002, 0.1], rel=0.05)


def test_an_exact_arm_has_no_offset() -> None:
    exact = ArmAccuracy(bias_x=0.0, bias_y=0.0, noise=0.0, noise_z=0.0, turn=0.0)
    assert draw_calibration_offset(exact, np.random.default_rng(1)) == ToolPose(0.0, 0.0, 0.0, 0.0)
