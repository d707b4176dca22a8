"""The hold over real processes that are killed: nothing moves until a person resumes."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from graph import HOLD_KEEPER, LATCHED, Graph, NodeProcess
from likeme_arm.hold_latch import HISTORY
from likeme_core.heartbeats import NodeState
from likeme_core.processes import die_with_parent
from likeme_core.ros.heartbeat import HeartbeatSubscriber
from likeme_core.ros.qos import kept
from likeme_msgs.msg import HoldState, Motion
from likeme_msgs.srv import ExecuteAction, MotionStatus

pytestmark = pytest.mark.graph
DRIVER = 'likeme_arm_sim.arm_driver_node'
Act = ExecuteAction.Request


class HeldCell:
    """A driver and a hold keeper that can be killed and started again."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.keeper = graph.start(HOLD_KEEPER)
        self.driver = graph.start(DRIVER, seed=1)
        self.states = graph.collect(HoldState, 'cell/hold_state', LATCHED)
        self.motions = graph.collect(Motion, 'motion', kept(100))
        self.joints = graph.collect(JointState, 'joint_states')
        self.monitor = HeartbeatSubscriber(graph.node).monitor
        graph.until(self.ready, 40, 'a driver that hears its keeper')

    def ready(self) -> bool:
        """Whether the driver may move."""
        driver = self.monitor.nodes.get('/arm_driver')
        return driver is not None and driver.state is NodeState.READY

    def kill(self, process: NodeProcess) -> None:
        """kill -9, as by the kernel."""
        process.signal(signal.SIGKILL)
        process.wait(10)

    def begin(self, who: str = 'human', **fields: Any) -> Any:
        """Ask for an action; the future of the answer."""
        request = Act(object='chicken', action='place_left', **fields)
        return self.graph.send(ExecuteAction, f'{who}/execute_action', request, 40)

    def end(self, future: Any, seconds: float = 30.0) -> ExecuteAction.Response:
        """Wait for an answer."""
        self.graph.until(future.done, seconds, 'an answer')
        return future.result()

    def again(self, send: Callable[[], Any], good: Callable[[Any], bool]) -> Any:
        """Send until there is a good answer: for some s, what is sent goes to a killed node."""
        answers: list[Any] = []
        times = [0.0]

        def answered() -> Any:
            if time.monotonic() > times[-1] + 2.0:
                times.append(time.monotonic())
                answers.append(send())
            return next((each for each in answers if each.done() and good(each.result())), None)

        return self.graph.until(answered, 60, 'an answer').result()

    def ask(self) -> ExecuteAction.Response:
        """Ask for an action; one request may be under way when the next one comes."""
        answer = self.again(self.begin, lambda response: response.outcome != Act.BUSY)
        assert isinstance(answer, ExecuteAction.Response)
        return answer

    def trigger(self, name: str) -> Trigger.Response:
        """Call cell/hold or cell/resume."""
        request = Trigger.Request()
        answer = self.again(
            lambda: self.graph.send(Trigger, f'cell/{name}', request, 40), lambda _: True
        )
        assert isinstance(answer, Trigger.Response)
        return answer

    def until_under_way(self, request_id: str) -> None:
        """Wait until a motion has begun, and half a second of it."""
        begun = lambda: [m for m in self.motions if m.id == request_id]  # noqa: E731
        self.graph.until(begun, 20, f'the motion {request_id}')
        seen = len(self.joints)
        self.graph.until(lambda: len(self.joints) > seen + 15, 20, 'joint_states')

    def status(self, request_id: str, who: str = 'human') -> Motion:
        """What the driver knows of a request."""
        request = MotionStatus.Request(id=request_id)
        return self.graph.call(MotionStatus, f'{who}/motion_status', request, 40).motion


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[HeldCell]:
    with Graph(tmp_path) as graph:
        yield HeldCell(graph)


def test_a_hold_outlives_the_driver_and_the_keeper_in_any_order(cell: HeldCell) -> None:
    first = cell.begin(id='first')
    cell.until_under_way('first')
    assert cell.trigger('hold').message == 'The cell is held.'
    held = cell.end(first, 5)
    assert (held.outcome, held.id) == (Act.HELD, 'first')

    cell.kill(cell.driver)
    cell.driver = cell.graph.start(DRIVER, seed=1)
    assert cell.ask().outcome == Act.HELD
    cell.kill(cell.keeper)
    cell.kill(cell.driver)
    cell.driver = cell.graph.start(DRIVER, seed=1)
    unheard = cell.ask()
    assert unheard.outcome == Act.HELD
    assert unheard.message == 'The hold keeper is not heard: nothing moves until it is.'
    cell.keeper = cell.graph.start(HOLD_KEEPER)
    cell.graph.until(lambda: 'held since' in cell.keeper.said, 20, 'what the keeper remembers')
    assert cell.ask().outcome == Act.HELD

    assert cell.trigger('resume').success
    cell.graph.until(lambda: not cell.states[-1].held, 10, 'the resume')
    again = cell.end(cell.begin(id='first'))
    assert again.outcome == Act.REPEATED
    assert 'ended as HELD' in again.message
    # A repeated question of `ask` may still be under way.
    assert cell.ask().outcome == Act.COMPLETED
    holds = cell.graph.collect(HoldState, 'cell/holds', kept(HISTORY))
    cell.graph.until(lambda: len(holds) >= 2, 20, 'the history of the hold')
    assert [state.held for state in holds][:2] == [True, False]


def test_a_motion_whose_driver_is_killed_is_lost_and_not_repeated(cell: HeldCell) -> None:
    cell.begin(id='one')
    cell.until_under_way('one')
    assert cell.status('one').state == Motion.UNDER_WAY
    cell.kill(cell.driver)
    cell.driver = cell.graph.start(DRIVER, seed=1)

    def lost() -> list[Motion]:
        return [m for m in cell.motions if m.id == 'one' and m.state == Motion.ENDED]

    cell.graph.until(lost, 30, 'the lost motion')
    assert lost()[0].outcome == Act.LOST
    cell.ask()
    assert cell.status('one').outcome == Act.LOST
    assert cell.status('unknown').state == Motion.UNKNOWN
    assert cell.end(cell.begin(id='one')).outcome == Act.REPEATED


def test_without_its_keeper_a_motion_ends(cell: HeldCell) -> None:
    motion = cell.begin('human', id='alone')
    cell.until_under_way('alone')
    cell.kill(cell.keeper)
    ended = cell.end(motion, 10)
    assert ended.outcome == Act.HELD
    assert ended.message == 'The motion was stopped: the hold keeper was not heard any more.'


class StopTerminal:
    """`stop` on a terminal of its own."""

    def __init__(self, domain: int) -> None:
        self._master, terminal = pty.openpty()
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'likeme_arm.ros.stop_command', '--by', 'Ada'],
            stdin=terminal, stdout=terminal, stderr=terminal,
            env=os.environ | {'ROS_DOMAIN_ID': str(domain)},
            start_new_session=True,
            preexec_fn=die_with_parent(os.getpid()),
        )  # fmt: skip
        os.close(terminal)
        self.said = ''

    def read(self) -> str:
        """All it has printed so far."""
        while select.select([self._master], [], [], 0)[0]:
            try:
                self.said += os.read(self._master, 4096).decode()
            except OSError:
                break
        return self.said

    def press(self, key: bytes) -> None:
        """Press a key."""
        os.write(self._master, key)


def test_one_key_stops_the_cell(cell: HeldCell) -> None:
    stop = StopTerminal(cell.graph.domain)
    try:
        cell.graph.until(lambda: 'Any key' in stop.read(), 30, 'the prompt')
        motion = cell.begin(id='stopped')
        cell.until_under_way('stopped')
        stop.press(b' ')
        ended = cell.end(motion, 5)
        assert ended.outcome == Act.HELD
        cell.graph.until(lambda: 'HELD, confirmed after' in stop.read(), 10, 'the confirmation')
        assert cell.states[-1].held
        assert cell.states[-1].by == 'Ada'
        assert cell.end(cell.begin()).outcome == Act.HELD
        # The service names nobody: who holds stays told.
        assert cell.trigger('hold').message == 'The cell was held already.'
        assert cell.states[-1].by == 'Ada'
        assert cell.trigger('resume').success
        stop.process.send_signal(signal.SIGINT)
        assert stop.process.wait(20) == 0
    finally:
        stop.process.kill()
        stop.process.wait(20)
