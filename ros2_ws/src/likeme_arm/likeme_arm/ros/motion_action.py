"""The action `execute_action` of one actor: its service, with feedback and cancel."""

from __future__ import annotations

import threading
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from likeme_arm import messages
from likeme_arm.motion_driver import MotionDriver
from likeme_arm.ros.motion_service import MotionService, new_id
from likeme_core.outcomes import MotionOutcome
from likeme_core.ros.time import steady_clock
from likeme_msgs.action import ExecuteAction

#: s between two feedback messages.
FEEDBACK_PERIOD = 0.1


class MotionAction:
    """Serves the action of the service's name by the service's own code.

    A cancelled goal stops its own motion where it is, and nothing moves until the next request.
    """

    def __init__(self, node: Node, driver: MotionDriver, service: MotionService) -> None:
        self._node, self._driver, self._service = node, driver, service
        self._cancelled: dict[bytes, threading.Event] = {}
        self._group = ReentrantCallbackGroup()
        self._server = ActionServer(
            node, ExecuteAction, service.name, self._execute, callback_group=self._group,
            goal_callback=self._accept, cancel_callback=self._cancel,
        )  # fmt: skip

    def destroy(self) -> None:
        """Destroy the action server, which its node does not do."""
        self._server.destroy()

    def _accept(self, goal: ExecuteAction.Goal) -> GoalResponse:
        goal.id = goal.id or new_id()
        return GoalResponse.ACCEPT

    def _cancel(self, handle: Any) -> CancelResponse:
        self._event(handle).set()
        return CancelResponse.ACCEPT

    def _event(self, handle: Any) -> threading.Event:
        """Set when this goal is cancelled, which may be before it is executed."""
        return self._cancelled.setdefault(bytes(handle.goal_id.uuid), threading.Event())

    async def _execute(self, handle: Any) -> ExecuteAction.Result:
        cancelled, accepted = self._event(handle), self._driver.now
        timer = self._node.create_timer(
            FEEDBACK_PERIOD, lambda: self._tell(handle, accepted), self._group, steady_clock()
        )
        try:
            report = await self._service.carry_out(handle.request, cancelled.is_set)
        finally:
            self._node.destroy_timer(timer)
            self._cancelled.pop(bytes(handle.goal_id.uuid), None)
        if report.outcome is MotionOutcome.COMPLETED:
            handle.succeed()
        elif handle.is_cancel_requested and report.outcome is MotionOutcome.HELD:
            handle.canceled()
        else:
            handle.abort()
        result = ExecuteAction.Result(id=handle.request.id)
        return messages.motion_response(report, result)

    def _tell(self, handle: Any, accepted: int) -> None:
        phase = self._driver.phase(handle.request.id)
        elapsed = (self._driver.now - accepted) * 1e-9
        handle.publish_feedback(ExecuteAction.Feedback(phase=phase, elapsed=elapsed))
