"""What an act needs of an arm and of the camera, and how it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from likeme_arm.tool_pose import ToolPose
from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import State


class PrimitiveResult(NamedTuple):
    """Outcome of a motion and a sentence for people."""

    outcome: MotionOutcome
    message: str


@dataclass(frozen=True)
class ObjectView:
    """One object as perception last reported it.

    x, y: centroid of the visible surface, m, base_link. yaw: major axis, rad. state: None while
    something covers it.
    """

    x: float
    y: float
    yaw: float
    state: State | None


# What the camera says about an object, by name; None when it never saw it.
ViewOf = Callable[[str], ObjectView | None]


class Motion(Protocol):
    """What the primitives need of an arm."""

    @property
    def tool(self) -> ToolPose:
        """Where the grasp point is now."""

    def reach(self, pose: ToolPose) -> None:
        """Swing to a pose through free space."""

    def move_to(
        self,
        pose: ToolPose,
        speed: float,
        until: Callable[[], bool] | None = None,
        free: float = 0.0,
    ) -> bool:
        """Move in a straight line, m/s, the first `free` m through free space.

        True when `until` stopped it.
        """

    def move_home(self) -> None:
        """Go where the camera's view is free."""

    def open_gripper(self, width: float = 0.08) -> None:
        """Open to `width` m."""

    def close_gripper(self) -> float:
        """Close and return the remaining width, m."""

    def holding(self) -> bool:
        """Whether something is between the closed fingers."""
