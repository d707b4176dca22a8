"""The inference node, killed in the middle of a session, takes it up where it was."""

from __future__ import annotations

import signal
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from fakes import Camera, make_request
from test_node import answer
from test_node_arm_failures import let_act

from graph import LATCHED, Graph, NodeProcess
from likeme_core.paper_world import WORLD
from likeme_core.ros.heartbeat import HEARTBEAT_QOS, HeartbeatPublisher
from likeme_core.ros.time import time_msg
from likeme_inference.experience.decision_log import LOG_FILE, DecisionLog
from likeme_msgs.msg import Decision, GoalBelief, Heartbeat, Motion, Outcome
from likeme_msgs.srv import AskHuman, ExecuteAction, MotionStatus

pytestmark = pytest.mark.graph
L, R, O = WORLD.states  # noqa: E741
NODE = 'likeme_inference.inference_node'


class ArmDriver:
    """Serves execute_action and motion_status with heartbeats; answers when `may_answer` is set.

    Attributes:
        requests: all that came. state, outcome: what is told of a motion.
        lands: where objects are after the next motion.
    """

    def __init__(self, graph: Graph, camera: Camera, state: int = Motion.UNDER_WAY) -> None:
        self.requests: list[ExecuteAction.Request] = []
        self.asked: list[str] = []
        self.state, self.outcome = state, ExecuteAction.Request.COMPLETED
        self.lands: dict[str, int] = {}
        self.may_answer = threading.Event()
        self._camera = camera
        graph.background_node('arm').create_service(
            ExecuteAction, 'arm/execute_action', self._execute
        )
        # Its own thread: it tells of motions that are under way.
        node = graph.background_node('arm_driver')
        node.create_service(MotionStatus, 'arm/motion_status', self._status)
        self.heartbeat = HeartbeatPublisher(node)

    def _execute(self, request: Any, response: Any) -> Any:
        self.requests.append(request)
        assert self.may_answer.wait(60), 'The test never let the arm answer.'
        self._camera.states |= self.lands
        response.outcome, response.success = self.outcome, True
        response.finished = time_msg(self._camera.stamp)
        return response

    def _status(self, request: Any, response: Any) -> Any:
        self.asked.append(request.id)
        motion = Motion(id=request.id, state=self.state, outcome=self.outcome, message='Told.')
        motion.finished = time_msg(self._camera.stamp)
        response.motion = motion
        return response


def log_of(tmp_path: Path, graph: Graph) -> DecisionLog:
    place = tmp_path / 'state' / f'domain_{graph.domain}' / LOG_FILE
    return DecisionLog(str(place), create=False)


def kinds(log: DecisionLog) -> list[str]:
    return [entry.kind for entry in log.entries() if entry.kind not in ('session', 'started')]


def restart(graph: Graph, node: NodeProcess, **parameters: Any) -> NodeProcess:
    """Kill the node and start it anew, when the first one's words are no longer heard."""
    node.signal(signal.SIGKILL)
    return graph.start(NODE, **parameters)


def restored(node: NodeProcess) -> Iterator[str]:
    return (line for line in node.said.splitlines() if 'Restored from' in line)


def test_killed_while_it_asks(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        node, camera = graph.start(NODE), Camera(graph)
        driver = ArmDriver(graph, camera)
        driver.lands = {'pear': int(L)}
        driver.may_answer.set()
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        number = make_request(graph, camera)
        before = graph.call(AskHuman, 'ask_human', AskHuman.Request()).pending
        node = restart(graph, node)
        graph.until(lambda: list(restored(node)), 20, 'a node that was restored')
        decisions = graph.collect(Decision, 'decision', LATCHED)
        beliefs = graph.collect(GoalBelief, 'goal_belief', LATCHED)
        graph.until(lambda: decisions and beliefs, 10, 'the last decision and belief')
        after = graph.call(AskHuman, 'ask_human', AskHuman.Request()).pending
        refused = answer(graph, number, AskHuman.Request.TRY_ANYWAY, object='chicken')
        accepted = answer(graph, number, AskHuman.Request.TRY_ANYWAY)
        outcome = graph.until(lambda: outcomes, 20, 'an outcome').pop()
        again = make_request(graph, camera)

        assert f'the question about decision {number} on pear goes on (ASKING)' in node.said
        assert [r.id for r in before] == [number]
        assert after == before
        assert decisions[0].id == number
        assert not refused.success
        assert accepted.success
        assert (outcome.decision_id, outcome.result) == (number, Outcome.REACHED)
        assert len(driver.requests) == 1
        assert again == number + 2
        assert 'Traceback' not in node.said
        log = log_of(tmp_path, graph)
        story = kinds(log)
        asked = story.index('question')
        assert story[asked - 1 : asked + 5] == [
            'decision', 'question', 'answer', 'motion_requested', 'motion_report', 'outcome',
        ]  # fmt: skip
        assert not log.verify().problem


@pytest.mark.parametrize(
    ('told', 'motion', 'result'),
    [
        (Motion.ENDED, ExecuteAction.Request.LOST, Outcome.REACHED),
        (Motion.UNKNOWN, 255, Outcome.ARM_FAILED),
    ],
)
def test_killed_while_it_acts(tmp_path: Path, told: int, motion: int, result: int) -> None:
    with Graph(tmp_path) as graph:
        node, camera = graph.start(NODE), Camera(graph)
        driver = ArmDriver(graph, camera)
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        decision = let_act(graph, camera)
        graph.until(lambda: driver.requests, 10, 'the request')
        node = restart(graph, node)
        graph.until(lambda: driver.asked, 20, 'a question about the motion')
        assert outcomes == []
        camera.states['chicken'] = int(L)
        driver.outcome, driver.state = (motion if motion != 255 else 0), told
        outcome = graph.until(lambda: outcomes, 20, 'an outcome').pop()
        driver.may_answer.set()
        driver.outcome = ExecuteAction.Request.COMPLETED
        camera.states['chicken'] = int(R)
        again = let_act(graph, camera)
        second = graph.until(lambda: outcomes, 20, 'a second outcome').pop()

        assert set(driver.asked) == {driver.requests[0].id}
        assert (outcome.decision_id, outcome.result) == (decision.id, result)
        assert outcome.motion_outcome == motion
        assert (second.decision_id, again.id) == (decision.id + 2, decision.id + 2)
        assert len(driver.requests) == 2
        assert len({request.id for request in driver.requests}) == 2
        assert not log_of(tmp_path, graph).verify().problem


def test_nothing_follows_from_what_cannot_be_logged(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        node, camera = graph.start(NODE), Camera(graph)
        driver = ArmDriver(graph, camera)
        driver.may_answer.set()
        beats = graph.collect(Heartbeat, 'heartbeat', HEARTBEAT_QOS)
        decisions = graph.collect(Decision, 'decision', LATCHED)
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        number = make_request(graph, camera)

        def state() -> int:
            own = [beat.state for beat in beats if beat.node == '/inference_node']
            return own[-1] if own else Heartbeat.STARTING

        graph.until(lambda: state() == Heartbeat.READY, 10, 'a ready node')
        place = tmp_path / 'state' / f'domain_{graph.domain}' / LOG_FILE
        with closing(sqlite3.connect(place, isolation_level=None)) as other:
            other.execute('BEGIN IMMEDIATE')
            refused = answer(graph, number, AskHuman.Request.TRY_ANYWAY)
            graph.until(lambda: state() == Heartbeat.DEGRADED, 10, 'a degraded node')
            assert not refused.success
            assert 'cannot be logged' in refused.message
            assert 'is locked' in refused.message
            assert [r.id for r in refused.pending] == [number]
            for _ in range(20):
                assert not answer(graph, number, AskHuman.Request.TRY_ANYWAY).success
            assert node.said.count('Answer refused') <= 2
            camera.states['pear'] = int(R)
            # Seen while nothing can be written: it is taken in afterwards.
            camera.show('lemon', R, L)
            graph.during(0.5)
            assert driver.requests == []
        graph.until(lambda: state() == Heartbeat.READY, 10, 'a ready node again')
        assert answer(graph, number, AskHuman.Request.TRY_ANYWAY).success
        graph.until(lambda: outcomes, 20, 'an outcome')
        assert len(driver.requests) == 1
        assert node.alive
        assert 'Traceback' not in node.said
        log = log_of(tmp_path, graph)
        assert kinds(log).count('demonstration') == 3
        assert 'From here on the log could not be written for a while' in ''.join(
            entry.text for entry in log.entries(['remark'])
        )
        about = {decision.object: decision.id for decision in decisions}
        assert about == {'pear': number, 'lemon': number + 1}
        assert not log.verify().problem
