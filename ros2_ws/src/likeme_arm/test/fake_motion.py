"""A `Motion` that records what it is told and reaches every pose at once."""

from __future__ import annotations

from collections.abc import Callable

from likeme_arm.tool_pose import NoSolutionError, ToolPose


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

    def reachable(self, pose: ToolPose) -> bool:
        return self._reaches

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
