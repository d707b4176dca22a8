"""The action of a joint trajectory controller, where control_msgs is installed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectory

from likeme_arm_sim.stand_in.trajectory_follower import TrajectoryFollower


class TrajectoryServer:
    """Serves CONTROLLER/follow_joint_trajectory on a follower.

    A new goal ends the one before; an aborted trajectory is told by `look`.
    """

    def __init__(
        self,
        node: Node,
        controller: str,
        follower: TrajectoryFollower,
        begin: Callable[[JointTrajectory], None],
    ) -> None:
        self._follower, self._begin = follower, begin
        self._ended: Future | None = None
        self._server = ActionServer(
            node, FollowJointTrajectory, f'{controller}/follow_joint_trajectory', self._execute,
            cancel_callback=self._cancel,
            callback_group=ReentrantCallbackGroup(),
        )  # fmt: skip

    def look(self) -> None:
        """To be called often: whether the trajectory under way has ended."""
        if self._ended is not None and not self._follower.under_way:
            ended, self._ended = self._ended, None
            ended.set_result(None)

    def _cancel(self, _: Any) -> CancelResponse:
        self._follower.halt()
        return CancelResponse.ACCEPT

    async def _execute(self, handle: Any) -> FollowJointTrajectory.Result:
        self._begin(handle.request.trajectory)
        ended = self._ended = Future()
        await ended
        result = FollowJointTrajectory.Result()
        if handle.is_cancel_requested:
            handle.canceled()
        elif self._follower.aborted:
            handle.abort()
            result.error_code = FollowJointTrajectory.Result.PATH_TOLERANCE_VIOLATED
            result.error_string = 'Aborted due to path tolerance violation'
        else:
            handle.succeed()
        return result
