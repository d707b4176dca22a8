"""The inference node as a real process: twelve demonstrations, three modes, the help desk."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from fakes import Arm, Camera

from graph import LATCHED, Graph
from likeme_core.observations import TableSnapshot
from likeme_core.paper_world import WORLD
from likeme_core.ros.time import stamp_ns
from likeme_core.tabletop import Manner, Mode
from likeme_inference import messages
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.session_inputs import read_demonstration
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.domain import TABLETOP, Policy
from likeme_inference.tabletop.imitation import ImitationSettings, believe, decide
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.planning import plan
from likeme_msgs.msg import Decision, Demonstration, GoalBelief, Outcome
from likeme_msgs.srv import AskHuman

pytestmark = pytest.mark.graph
L, R, O = WORLD.states  # noqa: E741
TWELVE = [
    (name, *change)
    for name in ('pear', 'lemon', 'chicken')
    for change in ((L, R), (L, O), (R, L), (R, O))
]


class Listener:
    """All the node publishes."""

    def __init__(self, graph: Graph) -> None:
        self.beliefs: list[GoalBelief] = graph.collect(GoalBelief, 'goal_belief', LATCHED)
        self.decisions: list[Decision] = graph.collect(Decision, 'decision', LATCHED)
        self.outcomes: list[Outcome] = graph.collect(Outcome, 'outcome', LATCHED)


def expected_decision(demo: Demonstration, mode: Mode, got: Decision) -> Decision:
    """Ask the library for its decision on the same demonstration and table."""
    value = read_demonstration(demo, WORLD)
    stamp = stamp_ns(got.header.stamp)
    view = TableSnapshot(stamp, got.header.frame_id, True, {demo.object: value.x_i})
    return messages.decision_msg(
        WORLD, decide(shipped(), ImitationSettings(mode=mode), value, view, got.id)
    )


def answer(graph: Graph, number: int, reply: int, by: str = 'Ada', **read: Any) -> Any:
    """Answer a request as it is listed; `read`: fields that were read otherwise."""
    listed = graph.call(AskHuman, 'ask_human', AskHuman.Request(command=AskHuman.Request.LIST))
    for item in listed.pending:
        action = WORLD.actions[item.action].name.lower()
        read = {'object': item.object, 'action': action, 'stamp': item.header.stamp} | read
    request = AskHuman.Request(
        command=AskHuman.Request.ANSWER, request_id=number, answer=reply, answered_by=by, **read
    )
    return graph.call(AskHuman, 'ask_human', request)


def imitate(graph: Graph, camera: Camera, heard: Listener, demo: Demonstration) -> Decision:
    """See a demonstration at its goal, put the object back; the decision that follows."""
    graph.until(lambda: heard.decisions, 10, 'AT_GOAL')
    assert heard.decisions.pop().kind == Kind.AT_GOAL
    camera.show(demo.object, demo.x_f, demo.x_i)
    decision: Decision = graph.until(lambda: heard.decisions, 10, 'a decision')[-1]
    heard.decisions.clear()
    return decision


@pytest.mark.parametrize('mode', Mode)
def test_twelve_demonstrations(tmp_path: Path, mode: Mode) -> None:
    with Graph(tmp_path) as graph:
        process = graph.start('likeme_inference.inference_node', mode=mode)
        camera = Camera(graph)
        arm, heard = Arm(graph, camera), Listener(graph)
        for number, (name, x_i, x_f) in enumerate(TWELVE):
            arm.requests.clear()
            demo = camera.show(name, x_i, x_f, Manner(number % 2))
            belief = graph.until(lambda: heard.beliefs, 20, 'a belief').pop()
            decision = imitate(graph, camera, heard, demo)
            if decision.kind == Kind.ASK_HUMAN:
                camera.states[name] = int(x_f)
                assert answer(graph, decision.id, AskHuman.Request.DONE_BY_HAND).success
            outcome = graph.until(lambda: heard.outcomes, 10, 'an outcome').pop()

            value = read_demonstration(demo, WORLD)
            assert belief == messages.belief_msg(
                WORLD, believe(shipped(), ImitationSettings(), value)
            )
            assert decision == expected_decision(demo, mode, decision)
            # Once, the pear is worth asking for; with three actions it is worth trying.
            asked = mode is Mode.INTERACTIVE and (name, x_i, x_f) == ('pear', R, L)
            assert decision.kind == (Kind.ASK_HUMAN if asked else Kind.EXECUTE)
            assert [r.action for r in arm.requests] == (
                [] if asked else [WORLD.actions[decision.action].name]
            )
            assert (outcome.result, outcome.decision_id) == (Outcome.REACHED, decision.id)
            assert outcome.actor == (Outcome.HUMAN if asked else Outcome.ROBOT)
        assert process.stop() == 0
        assert 'Traceback' not in process.said


def test_sequential_mode_tries_again_and_asks_when_its_actions_are_spent(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        process = graph.start(
            'likeme_inference.inference_node', mode='sequential', action_budget=2
        )
        camera = Camera(graph)
        arm, heard = Arm(graph, camera), Listener(graph)
        arm.lands = R
        first = imitate(graph, camera, heard, camera.show('lemon', R, L))
        graph.until(lambda: len(heard.outcomes) == 2, 20, 'two outcomes')
        again, asking = graph.until(lambda: len(heard.decisions) == 2 and heard.decisions, 10, '3')
        camera.states['lemon'] = int(L)
        assert answer(graph, asking.id, AskHuman.Request.DONE_BY_HAND).success
        graph.until(lambda: len(heard.outcomes) == 3, 10, 'the last outcome')

        decisions = [first, again, asking]
        assert [d.kind for d in decisions] == [Kind.EXECUTE, Kind.EXECUTE, Kind.ASK_HUMAN]
        assert [d.actions_left for d in decisions] == [2, 1, 0]
        assert [d.id for d in decisions] == [2, 3, 4]
        lemon = shipped().goal_model('lemon')
        best = plan(lemon.transition, lemon.goals[L] > 0, 2, TABLETOP.stuck)
        assert [d.plan_value for d in decisions] == best.value[::-1, R].tolist()
        assert [o.result for o in heard.outcomes] == [
            Outcome.MISSED, Outcome.MISSED, Outcome.REACHED,
        ]  # fmt: skip
        assert [r.action for r in arm.requests] == [
            WORLD.actions[d.action].name for d in decisions[:2]
        ]
        assert process.stop() == 0


@pytest.mark.parametrize('policy', Policy)
def test_policy_prior_and_soft_evidence_reach_the_decision(tmp_path: Path, policy: Policy) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node', policy=policy, concentration=0.09)
        camera = Camera(graph)
        heard = Listener(graph)
        demo = camera.show('lemon', L, R)
        graph.until(lambda: heard.beliefs, 20, 'the first belief')
        demo.x_i_probability, demo.x_f_probability = [0.8, 0.2, 0.0], [0.1, 0.7, 0.2]
        camera.send(demo)
        got = graph.until(lambda: len(heard.beliefs) == 2 and heard.beliefs[1], 20, 'two beliefs')

        value = read_demonstration(demo, WORLD)
        model = shipped().goal_model('lemon', policy=policy, concentration=0.09)
        settings = ImitationSettings(policy=policy, concentration=0.09)
        assert got == messages.belief_msg(WORLD, believe(shipped(), settings, value))
        expected = model.goal_posterior([0.8, 0.2, 0.0], [0.1, 0.7, 0.2])
        assert list(got.posterior) == expected.tolist()
        assert expected.tolist() != model.goal_posterior(L, R).tolist()


@pytest.mark.parametrize('learns', [True, False])
def test_outcomes_are_experience(tmp_path: Path, learns: bool) -> None:
    """PUSH_LEFT of the lemon worked 6 of 10 times; after a miss the next decision knows it."""
    store = tmp_path / 'experience.sqlite'
    with Graph(tmp_path) as graph:
        settings = {'experience_store': str(store), 'learn_from_outcomes': learns}
        process = graph.start('likeme_inference.inference_node', mode='goal_based', **settings)
        camera = Camera(graph)
        arm, heard = Arm(graph, camera), Listener(graph)
        arm.lands = R
        decisions = []
        for _ in range(2):
            camera.show('lemon', R, L)
            graph.until(lambda: heard.beliefs, 20, 'a belief').pop()
            graph.until(lambda: heard.decisions, 10, 'AT_GOAL')
            heard.decisions.clear()
            camera.show('lemon', L, R)
            decisions.append(graph.until(lambda: heard.decisions, 10, 'a decision').pop())
            graph.until(lambda: heard.outcomes, 10, 'an outcome').pop()
        assert process.stop() == 0

    assert decisions[0].predicted_success == 0.6
    assert decisions[1].predicted_success == pytest.approx(6 / 11 if learns else 0.6)
    assert (decisions[1].model != decisions[0].model) == learns
    kept = ExperienceStore(str(store), WORLD, create=False).tallies()
    assert sum(tally.trials for tally in kept) == (2 if learns else 0)


def test_a_store_that_is_none_is_refused_at_the_start(tmp_path: Path) -> None:
    (tmp_path / 'notes.txt').write_text('Not a database, and it stays as it is.')
    with Graph(tmp_path) as graph:
        place = str(tmp_path / 'notes.txt')
        process = graph.start('likeme_inference.inference_node', experience_store=place)

        assert process.wait(20) == os.EX_CONFIG
        assert 'inference_node does not start' in process.said
        assert 'expected an SQLite database' in process.said


def test_answers_and_their_refusals(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node')
        camera = Camera(graph)
        arm, heard = Arm(graph, camera), Listener(graph)
        arm.lands = R
        nothing = answer(graph, 1, AskHuman.Request.SKIP)
        decision = imitate(graph, camera, heard, camera.show('pear', R, L))
        listed = graph.call(AskHuman, 'ask_human', AskHuman.Request(command=AskHuman.Request.LIST))
        unknown = answer(graph, 99, AskHuman.Request.SKIP)
        bad = answer(graph, decision.id, 7)
        no_goal = answer(graph, decision.id, AskHuman.Request.NAME_GOAL)
        no_region = answer(graph, decision.id, AskHuman.Request.NAME_GOAL, goal='UPSTAIRS')
        nobody = answer(graph, decision.id, AskHuman.Request.SKIP, by=' ')
        chicken = answer(graph, decision.id, AskHuman.Request.TRY_ANYWAY, object='chicken')
        unread = answer(graph, decision.id, AskHuman.Request.TRY_ANYWAY, action='')
        earlier = answer(graph, decision.id, AskHuman.Request.TRY_ANYWAY, stamp=Time(sec=1))
        command = graph.call(AskHuman, 'ask_human', AskHuman.Request(command=2))
        accepted = answer(graph, decision.id, AskHuman.Request.TRY_ANYWAY)
        read = {'object': 'pear', 'action': 'push_left'}
        stamp = listed.pending[0].header.stamp
        repeated = answer(graph, decision.id, AskHuman.Request.TRY_ANYWAY, **read, stamp=stamp)
        second = answer(graph, decision.id, AskHuman.Request.DONE_BY_HAND, by='Bob')
        outcome = graph.until(lambda: heard.outcomes, 10, 'an outcome')[0]

        assert listed.success
        assert [(item.id, item.object) for item in listed.pending] == [(decision.id, 'pear')]
        assert listed.pending[0].question.startswith('I want the pear to go from RIGHT to LEFT')
        for refused, why in [
            (nothing, 'Nothing is pending'),
            (unknown, f'Expected one of the pending requests [{decision.id}], got 99.'),
            (bad, 'got 7.'),
            (no_goal, 'Expected a goal with NAME_GOAL alone, got none.'),
            (no_region, "got 'UPSTAIRS'"),
            (nobody, 'Expected the name of the operator'),
            (chicken, f'the open request {decision.id} (pear, push_left, of '),
            (chicken, 'got one to chicken, push_left, of '),
            (unread, 'got one to pear, no action, of '),
            (earlier, 'got one to pear, push_left, of 1.000 s.'),
            (command, 'Expected command 0 LIST or 1 ANSWER, got 2.'),
            (second, f'Request {decision.id} was answered already: TRY_ANYWAY by Ada.'),
        ]:
            assert not refused.success
            assert why in refused.message
        assert accepted.success
        assert (repeated.success, repeated.message) == (True, accepted.message)
        assert accepted.pending == second.pending == []
        assert (outcome.result, outcome.x_f, outcome.actor) == (Outcome.MISSED, R, Outcome.ROBOT)
        assert len(arm.requests) == 1


def test_a_late_subscriber_hears_the_last_belief(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node')
        camera = Camera(graph)
        early = Listener(graph)
        camera.show('lemon', R, O)
        graph.until(lambda: early.decisions, 20, 'AT_GOAL')
        late = Listener(graph)
        graph.until(lambda: late.decisions and late.beliefs, 10, 'the last belief and decision')

        assert late.beliefs == early.beliefs
        assert [d.id for d in late.decisions] == [d.id for d in early.decisions] == [1]
