"""The interface of an arm that the primitives use, and what they are given and return."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from likeme_arm.tool_pose import ToolPose
from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import State


class PrimitiveResult(NamedTuple):
    """How a primitive ended: its outcome, and a message in one sentence."""

    outcome: MotionOutcome
    message: str


class UnsafeMotionError(Exception):
    """A motion that would break a limit or touch something, and was not begun; says which."""


@dataclass(frozen=True)
class ObjectView:
    """One object as perception last reported it.

    x, y: centroid of the visible surface, m, base_link. yaw: major axis, rad. state: None while
    the object is occluded. length, width, height: along and across the major axis, and above the
    table, m; 0: not known.
    """

    x: float
    y: float
    yaw: float
    state: State | None
    length: float = 0.0
    width: float = 0.0
    height: float = 0.0


# The view of an object by its name; None if it was never seen.
ViewOf = Callable[[str], ObjectView | None]
# The views of all else that was seen, by name, beside the object of this name.
OthersOf = Callable[[str], Mapping[str, ObjectView]]
# Between the open fingers, m.
OPEN_WIDTH = 0.08


def no_others(_: str) -> Mapping[str, ObjectView]:
    """The object is alone on the table."""
    return {}


class Motion(Protocol):
    """The motions of an arm that the primitives use."""

    @property
    def tool(self) -> ToolPose:
        """Where the grasp point is now."""

    def reach(self, pose: ToolPose) -> None:
        """Move to a pose through free space, on the shortest way of the joints."""

    def move_to(
        self,
        pose: ToolPose,
        speed: float,
        until: Callable[[], bool] | None = None,
        free: float = 0.0,
    ) -> bool:
        """Move in a straight line at `speed` m/s, its first `free` m through free space.

        Returns True if `until` stopped it.
        """

    def reachable(self, pose: ToolPose) -> bool:
        """Whether inverse kinematics finds a solution for a pose; nothing moves."""

    def move_home(self) -> None:
        """Move to where the arm does not occlude the table."""

    def open_gripper(self, width: float = OPEN_WIDTH) -> None:
        """Open the gripper to `width` m."""

    def close_gripper(self) -> float:
        """Close the gripper; returns the width that remains, m."""

    def holding(self) -> bool:
        """Whether something is between the closed fingers."""
