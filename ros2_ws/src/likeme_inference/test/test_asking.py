"""The session asks by cost, and so that a promise is kept; its decisions can be made again."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest
from session_values import WORLD, ns, shown, table

from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import Mode, State
from likeme_inference.decision_record import (
    decision_record,
    recorded_world,
    rederive,
    world_record,
)
from likeme_inference.node_settings import read_settings, settings_of
from likeme_inference.tabletop import Kind, shipped
from likeme_inference.tabletop.asking import Asking, expected_successes
from likeme_inference.tabletop.cost_planning import Costs, Question
from likeme_inference.tabletop.imitation import ImitationSettings, first_promise, help_request
from likeme_inference.tabletop.intended_success import intended_success, meant
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.promise import Promise
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import SessionState
from likeme_inference.tabletop.values import (
    Decision,
    MotionReport,
    Outcome,
    Reply,
    RequestKind,
)
from likeme_inference.value_json import from_json, to_json, to_text

LEFT, RIGHT, OFFTABLE = WORLD.states


def session(**settings: object) -> ImitationSession:
    return ImitationSession(shipped(), ImitationSettings(turn_delay=0, **settings))  # type: ignore[arg-type]


def decide(here: ImitationSession, x_i: State, x_f: State, at: int = 3) -> Decision:
    here.observe_demonstration(shown('pear', x_i, x_f, at))
    decision = here.look(table(at + 2, pear=x_i))
    assert isinstance(decision, Decision)
    record = json.loads(to_text(decision_record(here, decision)))
    names = recorded_world(json.loads(to_text(world_record(WORLD))))
    assert rederive(record, names) == []
    assert from_json(Decision, record['decision'], WORLD) == decision
    return decision


def finish(here: ImitationSession, x_f: State, at: int) -> Outcome:
    here.motion_finished(MotionReport(MotionOutcome.COMPLETED, 'Done.', ns(at)))
    outcome = here.look(table(at + 1, pear=x_f))
    assert isinstance(outcome, Outcome)
    return outcome


def test_by_cost_it_acts_where_that_costs_least() -> None:
    """The paper asks here (0.4); three actions and help in the end cost less."""
    here = session(mode=Mode.SEQUENTIAL, asking=Asking.COST)
    decision = decide(here, RIGHT, LEFT)
    assert (decision.kind, str(decision.action)) == (Kind.EXECUTE, 'PUSH_LEFT')
    assert decision.costs is not None
    assert decision.costs.question is None
    assert decision.costs.act < min(decision.costs.help, decision.costs.which)
    assert f'acting is expected to cost {decision.costs.act:.2f}' in decision.sentence


def test_by_cost_it_asks_for_help_that_is_cheap() -> None:
    decision = decide(session(asking=Asking.COST, costs=Costs(help=0.05)), RIGHT, LEFT)
    assert decision.kind is Kind.ASK_HUMAN
    assert decision.costs is not None
    assert decision.costs.question is Question.HELP
    assert math.isnan(decision.costs.act)
    assert decision.sentence.endswith('I ask for help.')


def test_by_cost_it_asks_which_goal_was_meant() -> None:
    costs = Costs(help=3, question=0.01)
    here = session(mode=Mode.SEQUENTIAL, asking=Asking.COST, costs=costs)
    decision = decide(here, LEFT, OFFTABLE)
    assert decision.kind is Kind.ASK_HUMAN
    assert decision.costs is not None
    assert decision.costs.question is Question.WHICH
    best, other = decision.goal_posterior[OFFTABLE], decision.goal_posterior[decision.costs.other]
    request = help_request(decision)
    assert request.kind is RequestKind.WHICH_GOAL
    assert request.question.startswith(
        f'Did you mean OFFTABLE ({best:.2f}) or {decision.costs.other} ({other:.2f}) with the pear'
    )
    assert here.answered(Reply.NAME_GOAL, goal=decision.costs.other) is not None
    # What is certain is not asked for again.
    told = here.look(table(20))
    assert isinstance(told, Decision)
    assert (told.goal, told.costs and told.costs.question) != (OFFTABLE, Question.WHICH)
    assert told.goal_posterior[told.goal] == 1.0


def test_other_modes_do_not_ask() -> None:
    settings = {'asking': Asking.COST, 'costs': Costs(help=0.0)}
    assert decide(session(mode=Mode.GOAL_BASED, **settings), RIGHT, LEFT).kind is Kind.EXECUTE


def test_a_promise_starts_by_the_model_and_follows_the_outcomes() -> None:
    here = session(asking=Asking.PROMISE, promise=0.8)
    first = first_promise(here.model, here.settings)
    decision = decide(here, LEFT, RIGHT)
    assert decision.kind is Kind.EXECUTE
    assert decision.threshold == pytest.approx(first.threshold)
    missed = finish(here, LEFT, 20)
    assert missed.sentence.endswith('I promised 80%, kept 0% of the last 1.')
    kept = here.state.promise
    assert kept is not None
    assert kept.threshold == pytest.approx(first.threshold + 0.1 * 0.8)
    restored = from_json(SessionState, json.loads(to_text(to_json(here.state))), WORLD)
    assert restored.promise == kept
    assert decide(here, LEFT, RIGHT, at=30).threshold == pytest.approx(kept.threshold)


def test_what_the_robot_reached_counts_as_probably_meant() -> None:
    here = session(asking=Asking.PROMISE, promise=0.8, prior=Prior.SHARED)
    first = first_promise(here.model, here.settings)
    decision = decide(here, LEFT, RIGHT)
    belief = meant(shipped().goal_model('pear', prior=Prior.SHARED), LEFT, RIGHT)
    sure = intended_success(shipped().goal_model('pear', prior=Prior.SHARED), LEFT, belief)
    assert decision.action is not None
    assert f'where it was meant with p = {sure[decision.action]:.2f}' in decision.sentence
    finish(here, RIGHT, 20)
    assert here.state.promise is not None
    perhaps = float(belief[:, RIGHT].sum())
    assert here.state.promise.recent == (pytest.approx(perhaps),)
    assert perhaps < 0.95
    missed = 1 - perhaps
    assert here.state.promise.threshold == pytest.approx(first.threshold + 0.1 * (missed - 0.2))


@pytest.mark.parametrize('reply', [Reply.TRY_ANYWAY, Reply.NAME_GOAL])
def test_an_answer_makes_the_goal_certain(reply: Reply) -> None:
    here = session(asking=Asking.PROMISE, promise=1.0)
    assert decide(here, RIGHT, LEFT).kind is Kind.ASK_HUMAN
    goal = LEFT
    if reply is Reply.NAME_GOAL:
        goal = OFFTABLE
        here.answered(reply, goal=goal)
        here.settings = replace(here.settings, promise=0.2)
        told = here.look(table(20, pear=RIGHT))
        assert isinstance(told, Decision)
        assert told.kind is Kind.EXECUTE
    else:
        here.answered(reply)
    finish(here, goal, 30)
    assert here.state.promise is not None
    assert here.state.promise.recent == (1.0,)


def test_help_counts_and_what_was_not_seen_or_skipped_does_not() -> None:
    here = session(asking=Asking.PROMISE, promise=1.0)
    assert decide(here, RIGHT, LEFT).kind is Kind.ASK_HUMAN
    assert here.answered(Reply.SKIP) is not None
    assert here.state.promise is None
    decide(here, RIGHT, LEFT, at=20)
    here.answered(Reply.DONE_BY_HAND)
    outcome = here.look(table(30, pear=LEFT))
    assert isinstance(outcome, Outcome)
    assert outcome.sentence.endswith('I promised 100%, kept 100% of the last 1.')
    here.settings = replace(here.settings, promise=0.2)
    decide(here, RIGHT, LEFT, at=40)
    here.motion_finished(MotionReport(None, 'No arm.'))
    assert here.state.promise is not None
    assert here.state.promise.recent == ()


def test_a_promise_of_another_target_begins_anew() -> None:
    here = session(asking=Asking.PROMISE, promise=0.8)
    here.state.promise = Promise(0.9, 5.0)
    assert here.deciding_settings.threshold < 1
    here.settings = replace(here.settings, promise=0.9)
    # Threshold of a decision is a probability.
    assert here.deciding_settings.threshold == 1
    assert here.settings.threshold == 0.5


def test_no_plan_is_surer_of_what_was_meant_than_of_the_goal() -> None:
    pear = shipped().goal_model('pear')
    one, three = (
        expected_successes(pear, mode, 3) for mode in (Mode.INTERACTIVE, Mode.SEQUENTIAL)
    )
    assert len(one) == 4
    assert all(0 <= p <= 1 for p in (*one, *three))


def test_parameters_of_asking() -> None:
    values = {name: setting.default for name, setting in settings_of(WORLD).items()}
    read = read_settings({**values, 'asking': 'cost', 'costs': [1, 2, 3, 4, 5]}, WORLD)
    assert (read.asking, read.costs) == (Asking.COST, Costs(1, 2, 3, 4, 5))
    for name, value, message in (
        ('asking', 'never', "Expected asking threshold, cost, promise, got 'never'"),
        ('prior', 'none', "Expected a prior own, shared, structured, got 'none'"),
        ('costs', [1.0], 'Expected the costs of action, help, mess, waiting, question'),
        ('costs', 'much', 'Expected the costs of action, help'),
        ('costs', [0.1, -1.0, 1.0, 0.0, 0.2], 'Expected a cost of help of 0 or more, got -1'),
        ('promise', 1.5, 'Expected a promise from 0 to 1, got 1.5'),
    ):
        with pytest.raises(ValueError, match=message):
            read_settings({**values, name: value}, WORLD)
