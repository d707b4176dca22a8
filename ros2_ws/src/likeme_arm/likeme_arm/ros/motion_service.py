"""The services `execute_action` and `motion_status` of one actor."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from likeme_arm import messages
from likeme_arm.motion_driver import MotionDriver, MotionRequest, StampedResult
from likeme_arm.motion_journal import KEPT, JournalError, MotionJournal, MotionRecord
from likeme_arm.ros.job_future import job_ended
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.repeated_line import RepeatedLine
from likeme_core.ros.time import stamp_ns
from likeme_msgs.msg import Motion
from likeme_msgs.srv import ExecuteAction, MotionStatus

SERVICES = {Actor.ROBOT: 'arm/execute_action', Actor.HUMAN: 'human/execute_action'}
STATUS_SERVICES = {Actor.ROBOT: 'arm/motion_status', Actor.HUMAN: 'human/motion_status'}
CAME_LATE = 'The request came after its sender had given it up: nothing was started.'
BUSY = 'My last motion is still in progress: nothing was started.'


def new_id() -> str:
    """An id for a request without one: people at a console give none."""
    return uuid.uuid4().hex


class MotionService:
    """Serves the actions of the arm or of the person; answers when the motion has ended.

    Attributes:
        name: of the service.
        motions, refused: number of requests that moved something, and that did not.
    """

    def __init__(
        self, node: Node, driver: MotionDriver, actor: Actor, journal: MotionJournal
    ) -> None:
        self._node, self._driver, self._actor = node, driver, actor
        self._journal = journal
        # Ids of requests that their senders have given up; the lock: one of them may come now.
        self._refused_ids: dict[str, None] = {}
        self._lock, self._refusals = threading.Lock(), RepeatedLine()
        self.name, self.motions, self.refused = SERVICES[actor], 0, 0
        # The callback awaits the end of a motion; meanwhile other requests are answered BUSY.
        group = ReentrantCallbackGroup()
        # Coroutines are accepted, but not annotated.
        node.create_service(  # type: ignore[misc]
            ExecuteAction, self.name, self._execute, callback_group=group
        )
        node.create_service(MotionStatus, STATUS_SERVICES[actor], self._status)

    async def _execute(
        self, request: ExecuteAction.Request, response: ExecuteAction.Response
    ) -> ExecuteAction.Response:
        request.id = request.id or new_id()
        response.id = request.id
        return messages.motion_response(await self.carry_out(request), response)

    async def carry_out(
        self, request: Any, cancelled: Callable[[], bool] = lambda: False
    ) -> StampedResult:
        """Carry out a request once.

        Args:
            request: of the service, or a goal of the action; with an id.
            cancelled: asked at every control step.
        """
        report = await self._report(request, cancelled)
        line: str | None = f'{report.outcome.name}: {report.message}'
        if report.started:
            self.motions += 1
        else:
            self.refused += 1
            line = self._refusals.line(f'{report.outcome.name}: {report.message}')
        if line:
            self._node.get_logger().info(line)
        return report

    async def _report(self, request: Any, cancelled: Callable[[], bool]) -> StampedResult:
        try:
            self._driver.world.check_label(request.world)
        except ValueError as error:
            return StampedResult(MotionOutcome.OTHER_WORLD, str(error))
        motion = MotionRequest(
            self._actor,
            request.object,
            request.action,
            stamp_ns(request.expires),
            request.id,
            cancelled,
        )
        job = self._queue(motion)
        if isinstance(job, StampedResult):
            return job
        await job_ended(self._node, job)
        return job.result()

    def _queue(self, motion: MotionRequest) -> Future[StampedResult] | StampedResult:
        """Queue a motion, or why it is refused."""
        with self._lock:
            if motion.id in self._refused_ids:
                return StampedResult(MotionOutcome.EXPIRED, CAME_LATE)
            # Before BUSY: it may be this very request that is under way.
            try:
                before = self._find(motion.id)
            except JournalError as error:
                return StampedResult(MotionOutcome.FAILED, f'Nothing moved: {error}')
            if before is not None:
                return StampedResult(MotionOutcome.REPEATED, before.refusal)
            return self._driver.execute(motion) or StampedResult(MotionOutcome.BUSY, BUSY)

    def _status(
        self, request: MotionStatus.Request, response: MotionStatus.Response
    ) -> MotionStatus.Response:
        response.motion.id = request.id
        with self._lock:
            try:
                record = self._find(request.id)
            except JournalError as error:
                self._node.get_logger().error(str(error))
                response.motion.state = Motion.UNDER_WAY
                response.motion.message = f'It is not known whether it has ended: {error}'
                return response
            if record is not None:
                response.motion = messages.motion_msg(record, self._driver.now)
            elif request.refuse_unknown:
                self._refused_ids[request.id] = None
                if len(self._refused_ids) > KEPT:
                    self._refused_ids.pop(next(iter(self._refused_ids)))
        return response

    def _find(self, request_id: str) -> MotionRecord | None:
        """The request of an id.

        Raises:
            JournalError: what was kept cannot be read.
        """
        record = self._journal.find(request_id) or self._driver.waiting(request_id)
        return record if record is not None and record.actor is self._actor else None
