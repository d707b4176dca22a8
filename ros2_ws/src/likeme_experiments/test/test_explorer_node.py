"""The explorer against a fake cell: it acts on outcome codes, not on the text of a message."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from itertools import count

import pytest
from domain_coordinator import domain_id
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from likeme_core.outcomes import MotionOutcome, ResetOutcome
from likeme_core.paper_world import LEFT, OFFTABLE, PUSH_RIGHT, RIGHT, WORLD
from likeme_core.ros.time import time_msg
from likeme_experiments.learning.trial_observation import TrialVoidError
from likeme_experiments.ros.explorer_node import ExplorerNode
from likeme_inference.experience.trial import Pair, TrialKey
from likeme_msgs.msg import ObjectState, TableState
from likeme_msgs.srv import ExecuteAction, ResetCell

KEY = TrialKey('test', 'live-1', Pair('pear', LEFT, PUSH_RIGHT), 0)
FRAME = 100_000_000


class FakeCell(Node):
    """A pear that goes where a reset or a push puts it; resets answer `outcomes`, then succeed."""

    def __init__(self, context: Context) -> None:
        super().__init__('fake_cell', context=context, start_parameter_services=False)
        self.outcomes: list[ResetOutcome] = []
        self.resets = 0
        self._state, self._stamps = OFFTABLE, count(FRAME, FRAME)
        self._table = self.create_publisher(TableState, 'table_state', 1)
        self.create_timer(0.02, self._publish)
        self.create_service(ResetCell, 'cell/reset', self._reset)
        self.create_service(ExecuteAction, 'arm/execute_action', self._act)

    def _publish(self) -> None:
        message = TableState(settled=True)
        message.header.stamp = time_msg(next(self._stamps))
        message.objects = [ObjectState(name='pear', state=int(self._state), visible=True)]
        self._table.publish(message)

    def _reset(
        self, request: ResetCell.Request, response: ResetCell.Response
    ) -> ResetCell.Response:
        self.resets += 1
        outcome = self.outcomes.pop(0) if self.outcomes else ResetOutcome.COMPLETED
        response.outcome, response.success = outcome, outcome is ResetOutcome.COMPLETED
        response.message = 'A sentence in other words.'
        if response.success:
            self._state = WORLD.state(request.states[-1])
        return response

    def _act(
        self, request: ExecuteAction.Request, response: ExecuteAction.Response
    ) -> ExecuteAction.Response:
        self._state = WORLD.action(request.action).target
        response.success, response.outcome = True, int(MotionOutcome.COMPLETED)
        response.started, response.finished = (time_msg(next(self._stamps)) for _ in range(2))
        return response


@pytest.fixture
def cell_and_explorer() -> Iterator[tuple[FakeCell, ExplorerNode]]:
    with domain_id() as domain:
        context = Context()
        context.init(domain_id=domain)
        cell, explorer = FakeCell(context), ExplorerNode(WORLD, context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(cell)
        thread = threading.Thread(target=executor.spin)
        thread.start()
        try:
            explorer.wait_for_cell(30.0)
            yield cell, explorer
        finally:
            explorer.close()
            executor.shutdown()
            thread.join(10)
            cell.destroy_node()
            context.try_shutdown()


def test_a_busy_cell_is_asked_again(cell_and_explorer: tuple[FakeCell, ExplorerNode]) -> None:
    cell, explorer = cell_and_explorer
    cell.outcomes = [ResetOutcome.BUSY, ResetOutcome.BUSY]
    trial = explorer.make_trial(KEY, 1, '0')
    assert (trial.x_f, trial.motion) == (RIGHT, MotionOutcome.COMPLETED)
    assert cell.resets == 3


@pytest.mark.parametrize('outcome', [ResetOutcome.INVALID_REQUEST, ResetOutcome.FAILED])
def test_a_refused_reset_voids_the_trial(
    cell_and_explorer: tuple[FakeCell, ExplorerNode], outcome: ResetOutcome
) -> None:
    cell, explorer = cell_and_explorer
    cell.outcomes = [outcome]
    with pytest.raises(TrialVoidError, match='A sentence in other words'):
        explorer.make_trial(KEY, 1, '0')
    assert cell.resets == 1
