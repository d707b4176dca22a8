"""The service `execute_action` of one simulated actor."""

from __future__ import annotations

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from likeme_arm_sim import messages
from likeme_arm_sim.ros.job_future import job_ended
from likeme_arm_sim.simulation_driver import SimulationDriver, StampedResult
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.ros.time import stamp_ns
from likeme_msgs.srv import ExecuteAction

SERVICES = {Actor.ROBOT: 'arm/execute_action', Actor.HUMAN: 'human/execute_action'}
BUSY = 'My last motion is still in progress: nothing was started.'


class MotionService:
    """Serves the actions of the arm or of the person; answers when the motion has ended.

    Attributes:
        name: of the service.
        motions, refused: number of requests that moved something, and that did not.
    """

    def __init__(self, node: Node, driver: SimulationDriver, actor: Actor) -> None:
        self._node, self._driver, self._actor = node, driver, actor
        self.name, self.motions, self.refused = SERVICES[actor], 0, 0
        # The callback awaits the end of a motion; meanwhile other requests are answered BUSY.
        group = ReentrantCallbackGroup()
        # Coroutines are accepted, but not annotated.
        node.create_service(  # type: ignore[misc]
            ExecuteAction, self.name, self._execute, callback_group=group
        )

    async def _execute(
        self, request: ExecuteAction.Request, response: ExecuteAction.Response
    ) -> ExecuteAction.Response:
        report = await self._report(request)
        if report.started:
            self.motions += 1
        else:
            self.refused += 1
        self._node.get_logger().info(f'{report.outcome.name}: {report.message}')
        return messages.motion_response(report, response)

    async def _report(self, request: ExecuteAction.Request) -> StampedResult:
        try:
            self._driver.cell.world.check_label(request.world)
        except ValueError as error:
            return StampedResult(MotionOutcome.OTHER_WORLD, str(error))
        expires = stamp_ns(request.expires)
        job = self._driver.execute(self._actor, request.object, request.action, expires)
        if job is None:
            return StampedResult(MotionOutcome.BUSY, BUSY)
        await job_ended(self._node, job)
        return job.result()
