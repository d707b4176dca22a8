"""The inference node while a question is open: other objects are shown and moved beside it."""

from __future__ import annotations

import math
import signal
from pathlib import Path

import pytest
from fakes import Arm, Camera, make_request
from test_node import answer

from graph import LATCHED, Graph
from likeme_core.paper_world import WORLD
from likeme_msgs.msg import Calibration, Decision, Outcome
from likeme_msgs.srv import AskHuman

pytestmark = pytest.mark.graph
L, R, O = WORLD.states  # noqa: E741
NODE = 'likeme_inference.inference_node'


def pending(graph: Graph) -> list[str]:
    request = AskHuman.Request(command=AskHuman.Request.LIST)
    listed = graph.call(AskHuman, 'ask_human', request, again=2)
    return [item.object for item in listed.pending]


def show(graph: Graph, camera: Camera, name: str, x_f: int, kind: int) -> Decision:
    """Show an object being taken from RIGHT, put it back, and await what is decided for it."""
    seen = graph.collect(Decision, 'decision', LATCHED)
    graph.until(lambda: seen, 10, 'the last decision')
    camera.show(name, R, x_f)
    graph.until(
        lambda: (seen[-1].object, seen[-1].kind) == (name, Decision.AT_GOAL), 20, 'AT_GOAL'
    )
    camera.show(name, x_f, R)
    graph.until(lambda: (seen[-1].object, seen[-1].kind) == (name, kind), 20, 'a decision')
    return seen[-1]


def test_a_question_blocks_nothing_and_outlives_a_kill(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        node, camera = graph.start(NODE), Camera(graph)
        arm = Arm(graph, camera)
        arm.may_answer.clear()
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        kept = graph.collect(Calibration, 'calibration', LATCHED)
        pear = make_request(graph, camera)
        chicken = show(graph, camera, 'chicken', L, Decision.EXECUTE)
        graph.until(lambda: arm.requests, 10, 'a request to the arm')
        early = answer(graph, pear, AskHuman.Request.TRY_ANYWAY)
        arm.may_answer.set()
        graph.until(lambda: outcomes and kept, 20, 'the outcome of the act and its calibration')
        node.signal(signal.SIGKILL)
        node = graph.start(NODE)
        graph.until(lambda: 'Restored from' in node.said, 20, 'a node that was restored')
        restored = graph.collect(Decision, 'decision', LATCHED)
        graph.until(lambda: restored, 20, 'the last decision of the node that was restored')
        # The last message alone is kept for a subscriber that has not been found yet.
        graph.until(lambda: len(kept) == 2, 20, 'the calibration that was restored')
        still = pending(graph)
        tried = answer(graph, pear, AskHuman.Request.TRY_ANYWAY)
        graph.until(lambda: outcomes[-1].decision_id == pear, 20, 'the outcome of the try')
        graph.until(lambda: kept[-1].n == 2, 10, 'the calibration of both actions')

        assert not early.success
        assert early.message == (
            f'Decision {chicken.id} on chicken is under way: answer request {pear} when it has '
            'ended.'
        )
        assert f'Open questions: pear ({pear}).' in node.said
        assert still == ['pear']
        assert tried.success
        assert (outcomes[0].decision_id, outcomes[0].result) == (chicken.id, Outcome.REACHED)
        assert outcomes[-1].result == Outcome.REACHED
        assert [request.object for request in arm.requests] == ['chicken', 'pear']
        assert pending(graph) == []
        # The node that was killed had told of the first action, and its successor of it again.
        assert [message.n for message in kept] == [1, 1, 2]
        assert (kept[-1].promised, kept[-1].realised) == (pytest.approx((0.9 + 0.4) / 2), 1.0)
        assert kept[-1].sentence == 'I promised 65% and kept 100% of my last 2 actions.'
        assert math.isnan(kept[-1].target)
