"""The arm driver in simulated time: its journal and its hold are the real ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from sensor_msgs.msg import JointState

from faults_parts.sim_graph import Graph
from faults_parts.sim_node import SimNode, time_msg
from faults_parts.sim_table import Table
from likeme_arm.hold_monitor import Block, HoldMonitor
from likeme_arm.motion_journal import JournalError, MotionJournal, MotionRecord
from likeme_arm.ros.hold_topics import HoldTopics
from likeme_core.observations import TableSnapshot
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.ros.heartbeat import HeartbeatPublisher
from likeme_core.ros.qos import kept
from likeme_core.stamps import stamp_ns
from likeme_inference.session_inputs import read_table
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_msgs.msg import Motion
from likeme_msgs.srv import ExecuteAction, MotionStatus

CONTROL_PERIOD = 0.05
MOTION_TIME = 1.0
#: s for which a motion waits for a keeper that is not heard; as in the simulated cell.
PATIENCE = 2.0
SPEED = 0.5
_KEPT: Any = kept(100)


class Arm:
    """One run of the driver; motions carry objects as the model predicts."""

    def __init__(
        self, graph: Graph, table: Table, model: RobotModel, folder: Path, rng: np.random.Generator
    ) -> None:
        """Start the driver.

        Raises:
            JournalError: the journal cannot be opened.
        """
        self._graph, self._table, self._model, self._rng = graph, table, model, rng
        self._view: TableSnapshot | None = None
        self._moving: _Moving | None = None
        self._unwritten: list[MotionRecord] = []
        journal = MotionJournal(folder / 'motions.sqlite')
        self._journal = journal
        with graph.process('arm_driver') as self.process:
            node = SimNode('arm_driver')
            given: Any = node
            HeartbeatPublisher(given)
            self._refused_ids: set[str] = set()
            self._hold = HoldMonitor()
            HoldTopics(given, self._hold)
            self._joints = node.create_publisher(JointState, 'joint_states', 10)
            self._motions = node.create_publisher(Motion, 'motion', _KEPT)
            node.create_subscription(None, 'table_state', self._on_table, 1)
            node.serve('arm/execute_action', self._execute)
            node.create_service(MotionStatus, 'arm/motion_status', self._status)
            node.create_timer(CONTROL_PERIOD, self._step)
            for record in journal.lost:
                self._report(record)

    def close(self) -> None:
        """Let go of the journal; a motion that was under way stays as it is."""
        moving = self._moving
        if moving is not None and moving.begun and self._rng.random() < 0.5:
            self._arrive(moving.record)
        self._table.arm_over = False
        self._journal.close()

    def _on_table(self, message: Any) -> None:
        try:
            self._view = read_table(message, self._table.world)
        except ValueError:
            return

    def _execute(self, request: ExecuteAction.Request, respond: Callable[[Any], None]) -> None:
        record = MotionRecord(
            request.id, Actor.ROBOT, request.world, request.object, request.action
        )
        if record.id in self._refused_ids:
            respond(_response(record, MotionOutcome.EXPIRED, 'It was given up.'))
            return
        try:
            # Before BUSY: it may be this very request that is under way.
            before = self._journal.find(record.id)
            if before is None and self._moving is None:
                self._journal.begin(record)
        except JournalError as error:
            respond(_response(record, MotionOutcome.FAILED, f'Nothing moved: {error}'))
            return
        if before is not None:
            respond(_response(record, MotionOutcome.REPEATED, 'It was accepted before.'))
            return
        if self._moving is not None:
            respond(_response(record, MotionOutcome.BUSY, 'My last motion has not ended.'))
            return
        self._moving = _Moving(record, stamp_ns(request.expires), respond)
        self._report(record)
        self._graph.happens('motion accepted')

    def _status(
        self, request: MotionStatus.Request, response: MotionStatus.Response
    ) -> MotionStatus.Response:
        try:
            record = self._journal.find(request.id)
        except JournalError:
            response.motion = Motion(id=request.id, state=Motion.UNDER_WAY)
            return response
        if record is None and request.refuse_unknown:
            self._refused_ids.add(request.id)
        response.motion = Motion(id=request.id) if record is None else self._message(record)
        return response

    def _step(self) -> None:
        """One control step."""
        self._write()
        moving, speed = self._moving, 0.0
        if moving is not None:
            block = self._hold.block
            if block is Block.UNHEARD and moving.waited < PATIENCE:
                moving.waited += CONTROL_PERIOD
            elif block is not None:
                self._end(MotionOutcome.HELD, block.sentence)
            elif moving.done >= MOTION_TIME:
                self._arrive(moving.record)
                self._end(MotionOutcome.COMPLETED, 'The motion is complete.')
            elif self._begins(moving):
                moving.done += CONTROL_PERIOD
                speed = SPEED
        joints = JointState(velocity=[0.0, speed])
        joints.header.stamp = time_msg(self._table.ros_now)
        self._joints.publish(joints)

    def _begins(self, moving: _Moving) -> bool:
        """Begin to move, if that has not happened; whether it may."""
        if moving.begun:
            return True
        if moving.expires and self._table.ros_now > moving.expires:
            self._end(MotionOutcome.EXPIRED, 'The request has expired.')
            return False
        if self._view is None or moving.record.object not in self._view.states:
            self._end(MotionOutcome.OBJECT_NOT_SEEN, 'The object was not seen.')
            return False
        if moving.record.action in self._table.blocked:
            self._end(MotionOutcome.NOT_FREE, 'Something is in the way.')
            return False
        moving.begun, self._table.arm_over = self._table.ros_now, True
        self._graph.happens('motion begins')
        return True

    def _end(self, outcome: MotionOutcome, message: str) -> None:
        moving = self._moving
        assert moving is not None, 'Only a motion ends.'
        self._table.arm_over = False
        times = (moving.begun, self._table.ros_now) if moving.begun else (0, 0)
        record = moving.record._replace(
            outcome=outcome, message=message, started=times[0], finished=times[1]
        )
        self._graph.happens('motion ends')
        self._unwritten.append(record)
        self._write()
        self._moving = None
        self._report(record)
        moving.respond(_response(record, outcome, message))

    def _write(self) -> None:
        """Write the ends that are not written yet; none is told before it is tried."""
        try:
            while self._unwritten:
                self._journal.end(self._unwritten[0])
                del self._unwritten[0]
        except JournalError:
            return

    def _arrive(self, record: MotionRecord) -> None:
        """Put the object where the model says that it may go."""
        world, states = self._table.world, self._table.states
        action = world.action(record.action)
        row = self._model.objects[record.object].counts[states[record.object], int(action)]
        shares = np.asarray(row, dtype=float)
        if shares.sum():
            states[record.object] = int(self._rng.choice(len(shares), p=shares / shares.sum()))

    def _report(self, record: MotionRecord) -> None:
        self._motions.publish(self._message(record))

    def _message(self, record: MotionRecord) -> Motion:
        ended = record.outcome is not None
        message = Motion(
            id=record.id, state=Motion.ENDED if ended else Motion.UNDER_WAY,
            actor=int(record.actor), world=record.world, object=record.object,
            action=record.action, outcome=int(record.outcome or 0), message=record.message,
            started=time_msg(record.started), finished=time_msg(record.finished),
        )  # fmt: skip
        message.header.stamp = time_msg(self._table.ros_now)
        return message


class _Moving:
    """A request under way. begun: ROS time, ns; done, waited: s moved, and waited for a keeper."""

    def __init__(self, record: MotionRecord, expires: int, respond: Callable[[Any], None]) -> None:
        self.record, self.expires, self.respond = record, expires, respond
        self.begun, self.done, self.waited = 0, 0.0, 0.0


def _response(
    record: MotionRecord, outcome: MotionOutcome, message: str
) -> ExecuteAction.Response:
    return ExecuteAction.Response(
        success=outcome is MotionOutcome.COMPLETED, outcome=int(outcome), message=message,
        started=time_msg(record.started), finished=time_msg(record.finished), id=record.id,
    )  # fmt: skip
