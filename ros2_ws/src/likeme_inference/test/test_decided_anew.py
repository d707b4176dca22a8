"""Decisions that follow on another: after an action that was not free, and after a named goal."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from session_values import ns, shown, table
from test_session import DONE, show_and_put_back

from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.paper_world import LEFT, OFFTABLE, PLACE_LEFT, PUSH_LEFT, RIGHT, WORLD
from likeme_core.tabletop import Mode, State
from likeme_inference.decision_record import decision_record, rederive
from likeme_inference.session_inputs import OperatorAnswer, apply_input
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.asking import Asking
from likeme_inference.tabletop.cost_planning import Costs
from likeme_inference.tabletop.imitation import ImitationSettings, help_request
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import Phase
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    MotionReport,
    Outcome,
    Reply,
    RequestKind,
    Result,
)

WHY = 'No way to push the lemon to LEFT is free: the pear is in it.'
NOT_FREE = MotionReport(MotionOutcome.NOT_FREE, WHY)


def session(mode: Mode = Mode.INTERACTIVE, **settings: float) -> ImitationSession:
    return ImitationSession(shipped(), ImitationSettings(mode=mode, **settings))


def next_decision(here: ImitationSession, at: float, **states: object) -> Decision:
    decision = here.look(table(at, **states))
    assert isinstance(decision, Decision)
    return decision


def test_another_action_is_taken_where_one_is_not_free() -> None:
    here = session()
    push = show_and_put_back(here, 'chicken', RIGHT, LEFT)
    refused = here.motion_finished(NOT_FREE)
    place = next_decision(here, 9.1)

    assert (push.kind, push.action, push.blocked) == (Kind.EXECUTE, PUSH_LEFT, None)
    assert refused is not None
    assert (refused.result, refused.motion) == (Result.ARM_FAILED, MotionOutcome.NOT_FREE)
    assert refused.sentence == (
        f'PUSH_LEFT of the chicken was not begun: {WHY} Nothing moved; I decide anew.'
    )
    assert (place.kind, place.action, place.id) == (Kind.EXECUTE, PLACE_LEFT, push.id + 1)
    # An action that is not begun leaves the object where it is; what was shown means the same.
    assert place.success_probability == (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert place.action_probability == (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert place.goal_posterior == push.goal_posterior
    assert place.sentence == (
        'The chicken is RIGHT and wanted LEFT: my best action is PLACE_LEFT, which works with '
        f'p = 0.50. PUSH_LEFT is not free: {WHY}'
    )


@pytest.mark.parametrize('mode', [Mode.INTERACTIVE, Mode.SEQUENTIAL])
def test_it_asks_for_the_way_where_no_other_action_is_good_enough(mode: Mode) -> None:
    here = session(mode, action_budget=1)
    show_and_put_back(here, 'lemon', RIGHT, LEFT)
    here.motion_finished(NOT_FREE)
    asking = next_decision(here, 9.1)

    assert (asking.kind, asking.action, asking.predicted_success) == (
        Kind.ASK_HUMAN, PUSH_LEFT, 0.6
    )  # fmt: skip
    assert here.phase is Phase.ASKING
    assert asking.actions_left == 1
    assert asking.sentence == (
        'The lemon is RIGHT and wanted LEFT; PUSH_LEFT, which works with p = 0.60, is not free: I '
        f'ask. {WHY}'
    )
    request = help_request(asking)
    assert (request.kind, request.action) == (RequestKind.CLEAR_THE_WAY, PUSH_LEFT)
    assert Reply.TRY_ANYWAY in request.options
    assert request.question == (
        f'I want the lemon to be LEFT. {WHY} Will you clear the way and have me try PUSH_LEFT, '
        'do it by hand, or shall we skip it?'
    )


def test_the_action_is_tried_again_only_after_an_answer() -> None:
    here = session()
    show_and_put_back(here, 'lemon', RIGHT, LEFT)
    here.motion_finished(NOT_FREE)
    first = next_decision(here, 9.1)
    assert here.look(table(9.2)) is here.look(table(60)) is None
    assert here.answered(Reply.TRY_ANYWAY, 'lemon') is None
    still = here.motion_finished(NOT_FREE)
    second = next_decision(here, 61)
    assert here.answered(Reply.TRY_ANYWAY, 'lemon') is None
    assert here.motion_finished(replace(DONE, finished=ns(70))) is None
    reached = here.look(table(71, lemon=LEFT))

    assert still is not None
    assert (still.decision_id, still.result) == (first.id, Result.ARM_FAILED)
    assert (second.kind, second.id) == (Kind.ASK_HUMAN, first.id + 1)
    assert isinstance(reached, Outcome)
    assert (reached.decision_id, reached.result, reached.actor) == (
        second.id, Result.REACHED, Actor.ROBOT
    )  # fmt: skip
    assert here.phase is Phase.IDLE


def test_what_was_not_free_is_free_for_the_next_demonstration() -> None:
    here = session()
    show_and_put_back(here, 'lemon', RIGHT, LEFT)
    here.motion_finished(NOT_FREE)
    next_decision(here, 9.1)
    here.answered(Reply.SKIP)
    here.observe_demonstration(shown('lemon', RIGHT, LEFT, at=20))
    here.observe_demonstration(shown('lemon', LEFT, RIGHT, at=25))

    again = next_decision(here, 25)
    assert (again.kind, again.action, again.blocked) == (Kind.EXECUTE, PUSH_LEFT, None)


def test_an_action_is_blocked_only_where_it_was_refused() -> None:
    here = session()
    show_and_put_back(here, 'chicken', LEFT, OFFTABLE)
    here.motion_finished(NOT_FREE)
    elsewhere = next_decision(here, 9.1, chicken=RIGHT)

    assert elsewhere.blocked is None
    assert (elsewhere.x_i, elsewhere.kind) == (RIGHT, Kind.EXECUTE)


@pytest.mark.parametrize('mode', [Mode.TRAJECTORY, Mode.GOAL_BASED])
def test_a_mode_that_never_asks_ends_there(mode: Mode) -> None:
    here = session(mode)
    show_and_put_back(here, 'chicken', RIGHT, LEFT)
    refused = here.motion_finished(NOT_FREE)

    assert refused is not None
    assert 'I will not repeat it' in refused.sentence
    assert here.phase is Phase.IDLE
    assert here.look(table(9.1)) is None


@pytest.mark.parametrize('asking', Asking)
def test_decisions_after_a_refusal_follow_from_their_record(asking: Asking) -> None:
    here = ImitationSession(shipped(), ImitationSettings(asking=asking, threshold=0.1))
    decisions = [show_and_put_back(here, 'chicken', RIGHT, LEFT)]
    while decisions[-1].kind is Kind.EXECUTE:
        here.motion_finished(NOT_FREE)
        decisions.append(next_decision(here, 9 + len(decisions)))
        record = json.loads(json.dumps(decision_record(here, decisions[-1])))
        assert rederive(record, WORLD) == []

    assert len(decisions) > 1 or asking is not Asking.THRESHOLD
    asked = decisions[-1]
    assert asked.action == decisions[0].action
    if len(decisions) > 1:
        assert help_request(asked).kind is RequestKind.CLEAR_THE_WAY


def test_a_named_goal_is_decided_on_anew() -> None:
    here = session()
    asking = show_and_put_back(here, 'pear', RIGHT, LEFT)
    told, belief = apply_input(here, OperatorAnswer(Reply.NAME_GOAL, 'Ada', 'pear', goal=OFFTABLE))
    decision = next_decision(here, 9.1)

    assert asking.kind is Kind.ASK_HUMAN
    assert isinstance(told, Outcome)
    assert (told.result, told.actor, told.x_f) == (Result.GOAL_NAMED, Actor.NOBODY, None)
    assert told.sentence == 'The operator named the goal of the pear: I decide anew.'
    assert isinstance(belief, GoalBelief)
    assert (belief.goal, belief.posterior) == (OFFTABLE, (0.0, 0.0, 1.0))
    assert belief.sentence == 'I was told that the pear is wanted OFFTABLE.'
    assert (decision.kind, decision.goal, decision.goal_posterior) == (
        Kind.EXECUTE, OFFTABLE, (0.0, 0.0, 1.0)
    )  # fmt: skip
    assert decision.predicted_success == 0.6
    record = json.loads(json.dumps(decision_record(here, decision)))
    assert rederive(record, WORLD) == []


@pytest.mark.parametrize('x_i', [LEFT, RIGHT])
def test_a_named_goal_where_the_object_is_ends_it(x_i: State) -> None:
    here = session(threshold=1.0)
    show_and_put_back(here, 'lemon', x_i, OFFTABLE)
    here.answered(Reply.NAME_GOAL, 'lemon', x_i)
    decision = next_decision(here, 9.1, lemon=x_i)

    assert decision.kind is Kind.AT_GOAL
    assert here.phase is Phase.IDLE


def test_the_turn_that_a_named_goal_interrupts_goes_on_while_it_is_asked_again() -> None:
    here = session(threshold=0.7)
    show_and_put_back(here, 'pear', RIGHT, LEFT)
    here.observe_demonstration(shown('chicken', RIGHT, LEFT, at=20))
    here.look(table(20, chicken=LEFT))
    here.answered(Reply.NAME_GOAL, 'pear', OFFTABLE)
    asked = next_decision(here, 21, chicken=LEFT)
    assert (asked.object, asked.kind, asked.goal) == ('pear', Kind.ASK_HUMAN, OFFTABLE)
    here.look(table(22, chicken=LEFT))
    here.observe_demonstration(shown('chicken', LEFT, RIGHT, at=25))
    chicken = next_decision(here, 25)

    assert (chicken.object, chicken.kind) == ('chicken', Kind.EXECUTE)
    assert [question.object for question in here.state.questions] == ['pear']


@pytest.mark.parametrize(
    ('reply', 'goal'), [(Reply.NAME_GOAL, None), (Reply.SKIP, LEFT), (Reply.TRY_ANYWAY, LEFT)]
)
def test_a_goal_comes_with_its_answer_alone(reply: Reply, goal: object) -> None:
    here = session()
    show_and_put_back(here, 'pear', RIGHT, LEFT)

    with pytest.raises(ValueError, match='Expected a goal with NAME_GOAL alone'):
        here.answered(reply, 'pear', goal)
    assert here.phase is Phase.ASKING


@pytest.mark.parametrize('free', [{'action': 0.1}, {'action': 0.0}])
@pytest.mark.parametrize('asking', [Asking.THRESHOLD, Asking.COST])
@pytest.mark.parametrize('budget', [1, 3])
def test_no_action_that_was_refused_is_taken_again_by_itself(
    asking: Asking, budget: int, free: dict[str, float]
) -> None:
    # A refused action moves nothing: with several left, its plan is as good as that of the next.
    settings = ImitationSettings(
        mode=Mode.SEQUENTIAL, threshold=0.0, asking=asking, action_budget=budget,
        costs=Costs(help=5.0, **free),
    )  # fmt: skip
    for name in WORLD.objects:
        for x_i, x_f in ((RIGHT, LEFT), (LEFT, RIGHT), (LEFT, OFFTABLE)):
            here = ImitationSession(shipped(), settings)
            decision = show_and_put_back(here, name, x_i, x_f)
            taken = []
            while decision.kind is Kind.EXECUTE:
                assert decision.action not in taken
                taken.append(decision.action)
                here.motion_finished(NOT_FREE)
                decision = next_decision(here, 9 + len(taken), **{name: x_i})
            assert decision.kind is Kind.ASK_HUMAN
