"""The service `cell/reset`."""

from __future__ import annotations

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from likeme_arm.ros.job_future import job_ended
from likeme_arm_sim.messages import reset_outcome
from likeme_arm_sim.simulation_driver import SimulationDriver
from likeme_core.outcomes import ResetOutcome
from likeme_msgs.srv import ResetCell

BUSY = 'A motion is in progress: hold it before the cell is reset.'


class ResetService:
    """Put the simulated objects into states."""

    def __init__(self, node: Node, driver: SimulationDriver) -> None:
        self._node, self._driver = node, driver
        # The callback awaits the end of the reset; meanwhile other requests are answered.
        group = ReentrantCallbackGroup()
        # Coroutines are accepted, but not annotated.
        node.create_service(  # type: ignore[misc]
            ResetCell, 'cell/reset', self._reset, callback_group=group
        )

    async def _reset(
        self, request: ResetCell.Request, response: ResetCell.Response
    ) -> ResetCell.Response:
        job = self._driver.reset(list(request.objects), list(request.states), request.seed)
        if job is None:
            response.outcome, response.message = ResetOutcome.BUSY, BUSY
            return response
        await job_ended(self._node, job)
        error = job.exception()
        response.outcome = reset_outcome(error)
        response.success = error is None
        response.message = 'The table is set up.' if error is None else str(error)
        return response
