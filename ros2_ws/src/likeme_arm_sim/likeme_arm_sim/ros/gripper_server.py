"""The action of a gripper's controller, where control_msgs is installed."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from control_msgs.action import GripperCommand
from rclpy.action import ActionServer
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

#: Fingers that move less than this share of their way for REST s are at rest.
STEP, REST = 0.005, 0.3


class GripperServer:
    """Serves GripperCommand: a goal ends when the fingers rest, at the position or stalled."""

    def __init__(
        self,
        node: Node,
        name: str,
        positions: tuple[float, float],
        command: Callable[[float], None],
        position: Callable[[], float],
    ) -> None:
        self._step = STEP * abs(positions[0] - positions[1])
        self._command, self._position = command, position
        self._ended: Future | None = None
        self._last, self._since = 0.0, 0.0
        self._server = ActionServer(
            node, GripperCommand, name, self._execute, callback_group=ReentrantCallbackGroup()
        )

    def look(self) -> None:
        """To be called often: whether the fingers have come to rest."""
        now, position = time.monotonic(), self._position()
        if abs(position - self._last) > self._step:
            self._last, self._since = position, now
        if self._ended is not None and now - self._since > REST:
            ended, self._ended = self._ended, None
            ended.set_result(None)

    async def _execute(self, handle: Any) -> GripperCommand.Result:
        wanted = handle.request.command.position
        self._command(wanted)
        self._since = time.monotonic()
        ended = self._ended = Future()
        await ended
        result = GripperCommand.Result(position=self._position())
        result.reached_goal = abs(result.position - wanted) <= self._step
        result.stalled = not result.reached_goal
        handle.succeed()
        return result
