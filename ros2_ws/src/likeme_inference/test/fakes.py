"""A fake camera and a fake arm in the test's own process."""

from __future__ import annotations

import threading
from typing import Any

from builtin_interfaces.msg import Time

from graph import LATCHED, Graph
from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import WORLD
from likeme_core.ros.time import time_msg
from likeme_core.tabletop import Manner, State
from likeme_msgs.msg import Decision, Demonstration, ObjectState, TableState
from likeme_msgs.srv import ExecuteAction

TICK = 100_000_000


class Camera:
    """Publishes table states like a perception node: 50 a second, each a tenth of a second later.

    Attributes:
        states: what it sees; to be changed by the test.
        settled: whether all is at rest.
        stamp: ns of the last table state.
    """

    def __init__(self, graph: Graph, **states: int) -> None:
        self.states = {'pear': 1, 'lemon': 1, 'chicken': 1} | states
        self.settled = True
        self.stamp = 100 * TICK
        self._tables = graph.publisher(TableState, 'table_state', 1)
        self._demonstrations = graph.publisher(Demonstration, 'demonstration')
        self._timer = graph.node.create_timer(0.02, self.publish)

    def publish(self) -> None:
        """Publish the next table state."""
        self.stamp += TICK
        msg = TableState(reference_frame='base_link', settled=self.settled)
        msg.header.stamp, msg.header.frame_id = time_msg(self.stamp), 'camera'
        msg.objects = [ObjectState(name=n, state=s) for n, s in self.states.items()]
        self._tables.publish(msg)

    def stop(self) -> None:
        """Stop publishing."""
        self._timer.cancel()

    def go_on(self) -> None:
        """Publish again."""
        self._timer.reset()

    def show(self, name: str, x_i: int, x_f: int, manner: Manner = Manner.PLACE) -> Demonstration:
        """Move an object as a person does; the demonstration that was published."""
        start = self.stamp + TICK
        self.stamp += 3 * TICK
        self.states[name] = x_f
        msg = demonstration(name, x_i, x_f, manner)
        msg.header.stamp, msg.header.frame_id = time_msg(self.stamp), 'camera'
        msg.start, msg.end = time_msg(start), time_msg(self.stamp - TICK)
        self._demonstrations.publish(msg)
        return msg

    def send(self, msg: Demonstration) -> None:
        """Publish any demonstration."""
        self._demonstrations.publish(msg)


def demonstration(name: str, x_i: int, x_f: int, manner: Manner = Manner.PLACE) -> Demonstration:
    """Make a demonstration message with certain states."""
    certain = [[float(state == x) for state in WORLD.states] for x in (x_i, x_f)]
    return Demonstration(
        object=name, x_i=x_i, x_f=x_f, x_i_probability=certain[0], x_f_probability=certain[1],
        manner=manner, manner_probability=0.9, rise=0.1, start=Time(sec=1), end=Time(sec=2),
    )  # fmt: skip


class Arm:
    """Serves arm/execute_action; answers at once, or when `may_answer` is set.

    Attributes:
        requests: all that came.
        lands: where a moved object ends; None: where the action aims.
        outcome: what is answered.
        may_answer: answers wait for this event.
    """

    def __init__(self, graph: Graph, camera: Camera) -> None:
        self.requests: list[ExecuteAction.Request] = []
        self.lands: State | None = None
        self.outcome = MotionOutcome.COMPLETED
        self.may_answer = threading.Event()
        self.may_answer.set()
        self._camera = camera
        node = graph.background_node('arm')
        node.create_service(ExecuteAction, 'arm/execute_action', self._execute)

    def _execute(self, request: Any, response: Any) -> Any:
        self.requests.append(request)
        assert self.may_answer.wait(30), 'The test never let the arm answer.'
        response.outcome = self.outcome
        response.success = self.outcome == MotionOutcome.COMPLETED
        response.message = f'Outcome {self.outcome}.'
        if self.outcome.moved:
            aim = WORLD.action(request.action).target
            target = aim if self.lands is None else self.lands
            self._camera.states[request.object] = int(target)
            response.finished = time_msg(self._camera.stamp)
        return response


def make_request(graph: Graph, camera: Camera) -> int:
    """Demonstrate pear RIGHT to LEFT and put it back; the number of the request."""
    left, right = WORLD.state('LEFT'), WORLD.state('RIGHT')
    seen = graph.collect(Decision, 'decision', LATCHED)
    camera.show('pear', right, left)
    graph.until(lambda: seen and seen[-1].kind == Decision.AT_GOAL, 20, 'AT_GOAL')
    camera.show('pear', left, right)
    graph.until(lambda: seen[-1].kind == Decision.ASK_HUMAN, 10, 'ASK_HUMAN')
    return int(seen[-1].id)
