"""A replayed node: inputs in the recorded order, recorded reports, no motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fakes import Arm, Camera, demonstration
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile
from std_msgs.msg import Header

from graph import LATCHED, Graph
from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT, RIGHT
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_core.tabletop import Manner, Mode, State
from likeme_inference.session_inputs import InputKind
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.values import Result
from likeme_msgs.msg import Decision, Heard, Outcome, TableState
from likeme_msgs.srv import AskHuman

pytestmark = pytest.mark.graph
SECOND = 1_000_000_000


class Replay:
    """Sends inputs and waits for each to be acknowledged."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self.heard: list[Heard] = graph.collect(Heard, 'heard', QoSProfile(depth=100))
        self._pub = graph.publisher(Heard, 'hear_again', 100)

    def send(self, kind: InputKind, stamp: int, **fields: Any) -> Heard:
        count = len(self.heard)
        header = Header(stamp=time_msg(stamp), frame_id='camera')
        self._pub.publish(Heard(header=header, kind=int(kind), **fields))
        self._graph.until(lambda: len(self.heard) > count, 10, f'{kind.name} to be acknowledged')
        assert self.heard[-1].kind == kind
        return self.heard[-1]


def test_a_replayed_session_applies_recorded_inputs_and_moves_nothing(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node', mode=str(Mode.GOAL_BASED), replayed=True)
        camera = Camera(graph)
        camera.stop()
        arm = Arm(graph, camera)
        decisions = graph.collect(Decision, 'decision', LATCHED)
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        replay = Replay(graph)

        def table(seconds: int, state: State) -> None:
            camera.states['chicken'], camera.stamp = int(state), seconds * SECOND - SECOND // 10
            camera.publish()
            replay.send(InputKind.TABLE_STATE, seconds * SECOND)

        table(10, LEFT)
        act = demonstration('chicken', RIGHT, LEFT, Manner.PLACE)
        act.header.stamp = time_msg(10 * SECOND)
        camera.send(act)
        assert replay.send(InputKind.DEMONSTRATION, 10 * SECOND).events == 2
        table(11, RIGHT)
        table(12, RIGHT)
        graph.until(lambda: len(decisions) == 2, 10, 'the decision to act')
        assert decisions[-1].kind == Kind.EXECUTE
        # No new table state for long by the wall clock, which must not matter.
        motion = {
            'motion_outcome': int(MotionOutcome.COMPLETED),
            'finished': time_msg(13 * SECOND),
        }
        assert not replay.send(
            InputKind.MOTION, 12 * SECOND, message='Done then.', **motion
        ).refused
        table(14, LEFT)
        (outcome,) = graph.until(lambda: outcomes, 10, 'the outcome')
        assert (outcome.result, stamp_ns(outcome.header.stamp)) == (Result.REACHED, 14 * SECOND)
        assert arm.requests == []
        # An input that does not fit the session is refused.
        assert replay.send(InputKind.ANSWER, 14 * SECOND, answer=0, message='Ada').refused


def test_a_replayed_session_refuses_the_operator_and_ends_with_a_new_session(
    tmp_path: Path,
) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node', replayed=True)
        request = AskHuman.Request(command=AskHuman.Request.ANSWER, request_id=1, answered_by='A')
        refused = graph.call(AskHuman, 'ask_human', request)
        assert not refused.success
        assert 'the recorded operator answers' in refused.message
        client = AsyncParameterClient(graph.node, 'inference_node')
        graph.until(client.services_are_ready, 20, 'parameters')
        future = client.set_parameters([Parameter('replayed', value=False)])
        graph.until(future.done, 10, 'an answer')
        heard = graph.collect(Heard, 'heard', QoSProfile(depth=100))
        tables = graph.publisher(TableState, 'table_state', 1)

        def taken_live() -> bool:
            tables.publish(TableState(reference_frame='base_link'))
            graph.during(0.1)
            return bool(heard)

        graph.until(taken_live, 10, 'a table state of the live session')
        assert heard[0].kind == InputKind.TABLE_STATE
