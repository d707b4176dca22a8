"""The inference node as a managed node: while it is not active nothing follows from anything."""

from __future__ import annotations

from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from fakes import Arm, Camera
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState

from graph import LATCHED, Graph
from likeme_core.paper_world import WORLD
from likeme_msgs.msg import Decision, GoalBelief, Outcome
from likeme_msgs.srv import AskHuman

pytestmark = pytest.mark.graph
L, R, O = WORLD.states  # noqa: E741


#: State after each transition.
REACHED = {
    Transition.TRANSITION_CONFIGURE: State.PRIMARY_STATE_INACTIVE,
    Transition.TRANSITION_ACTIVATE: State.PRIMARY_STATE_ACTIVE,
    Transition.TRANSITION_DEACTIVATE: State.PRIMARY_STATE_INACTIVE,
}


def set_state(graph: Graph, transition: int) -> None:
    """Ask for a transition once, as it works once, and wait for its state.

    The node drops the response if it has not discovered this client within 0.1 s.
    """
    request = ChangeState.Request(transition=Transition(id=transition))
    asked = graph.send(ChangeState, 'inference_node/change_state', request)

    def reached() -> bool:
        state = graph.call(GetState, 'inference_node/get_state', GetState.Request(), again=2)
        return bool(state.current_state.id == REACHED[transition])

    graph.until(reached, 20, f'state {REACHED[transition]}')
    assert not asked.done() or asked.result().success


def until_reported(graph: Graph, key: str, value: str) -> None:
    """Wait until /diagnostics has a value."""
    messages = graph.collect(DiagnosticArray, '/diagnostics')

    def reported() -> bool:
        return any(
            item.key == key and item.value == value
            for message in messages
            for item in message.status[0].values
        )

    graph.until(reported, 20, f'{key} = {value}')


def test_an_inactive_node_takes_no_demonstration_and_goes_on_when_activated(
    tmp_path: Path,
) -> None:
    with Graph(tmp_path) as graph:
        node = graph.start('likeme_inference.inference_node', autostart=False)
        camera = Camera(graph)
        arm = Arm(graph, camera)
        beliefs = graph.collect(GoalBelief, 'goal_belief', LATCHED)
        set_state(graph, Transition.TRANSITION_CONFIGURE)
        camera.show('chicken', R, L)
        until_reported(graph, 'demonstrations while not active', '1')
        assert (beliefs, arm.requests) == ([], [])

        set_state(graph, Transition.TRANSITION_ACTIVATE)
        camera.show('chicken', L, R)
        assert graph.until(lambda: beliefs, 20, 'a belief')[0].x_f == R
        assert node.stop() == 0


def test_a_question_stays_open_and_is_not_answered_while_the_node_is_inactive(
    tmp_path: Path,
) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node')
        camera = Camera(graph)
        arm = Arm(graph, camera)
        decisions = graph.collect(Decision, 'decision', LATCHED)
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        camera.show('pear', R, L)
        camera.states['pear'] = R
        number = graph.until(
            lambda: [d for d in decisions if d.kind == Decision.ASK_HUMAN], 20, 'a question'
        )[0].id
        set_state(graph, Transition.TRANSITION_DEACTIVATE)
        listed = graph.call(AskHuman, 'ask_human', AskHuman.Request())
        question = listed.pending[0]
        answer = AskHuman.Request(
            command=AskHuman.Request.ANSWER,
            request_id=number,
            answer=AskHuman.Request.TRY_ANYWAY,
            answered_by='Ada',
            object=question.object,
            action=WORLD.action(question.action).name,
            stamp=question.header.stamp,
        )
        refused = graph.call(AskHuman, 'ask_human', answer)
        assert (refused.success, arm.requests) == (False, [])
        assert refused.message == 'The inference node is not active: activate it first.'

        set_state(graph, Transition.TRANSITION_ACTIVATE)
        assert graph.call(AskHuman, 'ask_human', answer).success
        graph.until(lambda: outcomes, 20, 'an outcome')
        assert len(arm.requests) == 1


def test_the_end_of_a_motion_is_taken_in_while_the_node_is_inactive(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node', outcome_timeout=1.0)
        camera = Camera(graph)
        arm = Arm(graph, camera)
        arm.may_answer.clear()
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        camera.show('chicken', R, L)
        camera.states['chicken'] = R
        graph.until(lambda: arm.requests, 20, 'a request to the arm')
        set_state(graph, Transition.TRANSITION_DEACTIVATE)
        arm.may_answer.set()
        until_reported(graph, 'phase', 'CONFIRMING')
        assert outcomes == []

        set_state(graph, Transition.TRANSITION_ACTIVATE)
        outcome = graph.until(lambda: outcomes, 20, 'an outcome')[0]
        assert (outcome.result, len(arm.requests)) == (Outcome.REACHED, 1)
