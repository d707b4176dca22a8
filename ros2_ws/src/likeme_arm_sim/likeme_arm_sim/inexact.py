"""An arm that is not quite where it believes to be: calibration error and play.

The primitives command and read poses in the frame the camera is thought to share with the arm; the
true hand is a little beside, the same way for the whole of one motion.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from likeme_arm_sim.kinematics import ToolPose
from likeme_arm_sim.physics import ArmAccuracy
from likeme_arm_sim.primitives import Motion


def draw_offset(accuracy: ArmAccuracy, rng: np.random.Generator) -> ToolPose:
    """True pose minus believed pose of the hand for one motion (m, m, m, rad)."""
    x, y, z, turn = rng.normal(size=4)
    return ToolPose(
        accuracy.bias_x + accuracy.noise * float(x),
        accuracy.bias_y + accuracy.noise * float(y),
        accuracy.noise_z * float(z),
        accuracy.turn * float(turn),
    )


class InexactMotion:
    """A Motion whose true poses are the commanded ones plus an offset."""

    def __init__(self, motion: Motion, offset: ToolPose) -> None:
        self._motion, self._offset = motion, offset

    @property
    def tool(self) -> ToolPose:
        """Where the arm believes the grasp point to be."""
        return ToolPose(*(a - b for a, b in zip(self._motion.tool, self._offset, strict=True)))

    def reach(self, pose: ToolPose) -> None:
        """Swing to a pose through free space."""
        self._motion.reach(self._true(pose))

    def move_to(
        self, pose: ToolPose, speed: float, until: Callable[[], bool] | None = None
    ) -> bool:
        """Move in a straight line, m/s; True when `until` stopped it."""
        return self._motion.move_to(self._true(pose), speed, until)

    def move_home(self) -> None:
        """Go where the camera's view is free."""
        self._motion.move_home()

    def open_gripper(self, width: float = 0.08) -> None:
        """Open to `width` m."""
        self._motion.open_gripper(width)

    def close_gripper(self) -> float:
        """Close and return the remaining width, m."""
        return self._motion.close_gripper()

    def holding(self) -> bool:
        """Whether something is between the closed fingers."""
        return self._motion.holding()

    def _true(self, pose: ToolPose) -> ToolPose:
        return ToolPose(*(a + b for a, b in zip(pose, self._offset, strict=True)))
