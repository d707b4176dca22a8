"""Error of the hand-eye calibration, and play of the arm.

The primitives command and read poses in the frame that camera and arm are assumed to share. The
true frame is rotated about the middle of the work area, and the hand is displaced by an offset,
which is constant during one motion.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from likeme_arm.motion import Motion
from likeme_arm.tool_pose import ToolPose
from likeme_arm_sim.physics import ArmAccuracy


def draw_calibration_offset(accuracy: ArmAccuracy, rng: np.random.Generator) -> ToolPose:
    """True minus assumed pose of the hand for one motion (m, m, m, rad)."""
    x, y, z, turn = rng.normal(size=4)
    return ToolPose(
        accuracy.bias_x + accuracy.noise * float(x),
        accuracy.bias_y + accuracy.noise * float(y),
        accuracy.noise_z * float(z),
        accuracy.turn * float(turn),
    )


class MiscalibratedMotion:
    """A Motion whose true poses are the commanded ones, rotated and displaced."""

    def __init__(
        self,
        motion: Motion,
        offset: ToolPose,
        skew: float = 0.0,
        centre: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """offset: true minus assumed pose. skew: rotation about `centre`, rad."""
        self._motion, self._offset = motion, offset
        self._skew, self._centre = skew, np.array(centre)

    @property
    def tool(self) -> ToolPose:
        """The assumed pose of the grasp point."""
        displaced = (a - b for a, b in zip(self._motion.tool, self._offset, strict=True))
        return self._rotated(ToolPose(*displaced), -self._skew)

    def reach(self, pose: ToolPose) -> None:
        """Move to a pose through free space."""
        self._motion.reach(self._true(pose))

    def reachable(self, pose: ToolPose) -> bool:
        """Whether the arm reaches a pose."""
        return self._motion.reachable(self._true(pose))

    def move_to(
        self,
        pose: ToolPose,
        speed: float,
        until: Callable[[], bool] | None = None,
        free: float = 0.0,
    ) -> bool:
        """Move in a straight line, m/s; returns True if `until` stopped it."""
        return self._motion.move_to(self._true(pose), speed, until, free)

    def move_home(self) -> None:
        """Move to the home pose."""
        self._motion.move_home()

    def open_gripper(self, width: float = 0.08) -> None:
        """Open the gripper to `width` m."""
        self._motion.open_gripper(width)

    def close_gripper(self) -> float:
        """Close the gripper; returns the remaining width, m."""
        return self._motion.close_gripper()

    def holding(self) -> bool:
        """Whether something is between the closed fingers."""
        return self._motion.holding()

    def _true(self, pose: ToolPose) -> ToolPose:
        rotated = self._rotated(pose, self._skew)
        return ToolPose(*(a + b for a, b in zip(rotated, self._offset, strict=True)))

    def _rotated(self, pose: ToolPose, angle: float) -> ToolPose:
        cos, sin = np.cos(angle), np.sin(angle)
        away = np.array([[cos, -sin], [sin, cos]]) @ (pose.position[:2] - self._centre)
        x, y = map(float, self._centre + away)
        return ToolPose(x, y, pose.z, pose.yaw + angle)
