"""The inference node after an action that was not free, and after a goal that was named."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from fakes import Arm, Camera
from test_node import answer

from graph import LATCHED, Graph
from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import WORLD
from likeme_msgs.msg import Decision, GoalBelief, HelpRequest, Outcome
from likeme_msgs.srv import AskHuman

pytestmark = pytest.mark.graph
L, R, O = WORLD.states  # noqa: E741
NODE = 'likeme_inference.inference_node'


def test_it_asks_for_the_way_across_a_kill_and_takes_the_goal_that_is_named(
    tmp_path: Path,
) -> None:
    with Graph(tmp_path) as graph:
        node, camera = graph.start(NODE), Camera(graph)
        arm = Arm(graph, camera)
        arm.outcome = MotionOutcome.NOT_FREE
        decisions = graph.collect(Decision, 'decision', LATCHED)
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        camera.show('lemon', R, L)
        graph.until(lambda: decisions and decisions[-1].kind == Decision.AT_GOAL, 20, 'AT_GOAL')
        camera.show('lemon', L, R)
        graph.until(lambda: decisions[-1].kind == Decision.ASK_HUMAN, 20, 'a question')
        graph.until(lambda: outcomes, 20, 'the outcome of the motion that was not begun')
        node.signal(signal.SIGKILL)
        node = graph.start(NODE)
        graph.until(lambda: 'Restored from' in node.said, 20, 'a node that was restored')
        listed = graph.call(AskHuman, 'ask_human', AskHuman.Request(command=0), again=2)
        arm.outcome = MotionOutcome.COMPLETED
        beliefs = graph.collect(GoalBelief, 'goal_belief', LATCHED)
        taken = answer(graph, listed.pending[0].id, AskHuman.Request.NAME_GOAL, goal='offtable')
        graph.until(lambda: outcomes[-1].result == Outcome.REACHED, 20, 'the goal that was named')
        graph.until(lambda: beliefs and beliefs[-1].goal == O, 10, 'the belief in it')

        assert (outcomes[0].result, outcomes[0].motion_outcome) == (
            Outcome.ARM_FAILED, MotionOutcome.NOT_FREE
        )  # fmt: skip
        (question,) = listed.pending
        assert (question.kind, WORLD.actions[question.action].name) == (
            HelpRequest.CLEAR_THE_WAY, 'PUSH_LEFT'
        )  # fmt: skip
        assert question.question.startswith('I want the lemon to be LEFT. Outcome 14.')
        assert taken.success, taken.message
        assert list(beliefs[-1].posterior) == [0.0, 0.0, 1.0]
        assert outcomes[-1].goal == O
        assert [request.action for request in arm.requests] == ['PUSH_LEFT', 'PLACE_OFFTABLE']
