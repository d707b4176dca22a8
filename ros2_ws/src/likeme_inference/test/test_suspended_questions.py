"""A question of a session blocks neither other questions nor demonstrations of other objects."""

from __future__ import annotations

from dataclasses import replace

import pytest
from session_values import ns, shown, table
from test_session import DONE, show_and_put_back

from likeme_core.outcomes import Actor
from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT
from likeme_core.tabletop import Mode, State
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import ImitationSettings
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import Phase
from likeme_inference.tabletop.values import Decision, Outcome, Remark, Reply, Result


def asked_about_the_pear() -> ImitationSession:
    """A session that asks about the pear, in request 2; it is 9 s."""
    here = ImitationSession(shipped(), ImitationSettings(mode=Mode.INTERACTIVE))
    assert show_and_put_back(here, 'pear', RIGHT, LEFT).kind is Kind.ASK_HUMAN
    return here


def show_chicken(here: ImitationSession, at: float, x_f: State = LEFT) -> Decision:
    """Demonstrate the chicken and put it back; what is decided for it."""
    here.observe_demonstration(shown('chicken', RIGHT, x_f, at=at))
    here.look(table(at, chicken=x_f))
    here.observe_demonstration(shown('chicken', x_f, RIGHT, at=at + 5))
    decision = here.look(table(at + 5))
    assert isinstance(decision, Decision)
    return decision


def test_another_object_is_imitated_while_a_question_is_open() -> None:
    here = asked_about_the_pear()
    decision = show_chicken(here, 20)
    here.motion_finished(DONE)
    reached = here.look(table(30, chicken=LEFT))

    assert (decision.kind, decision.id) == (Kind.EXECUTE, 4)
    assert isinstance(reached, Outcome)
    assert reached.result is Result.REACHED
    assert here.phase is Phase.IDLE
    assert [asked.object for asked in here.state.questions] == ['pear']

    assert here.answered(Reply.TRY_ANYWAY, 'pear') is None
    assert here.phase is Phase.ACTING
    assert here.decision is not None
    assert here.decision.object == 'pear'
    here.motion_finished(replace(DONE, finished=ns(40)))
    outcome = here.look(table(41, pear=LEFT))
    assert isinstance(outcome, Outcome)
    assert (outcome.decision_id, outcome.result, outcome.actor) == (2, Result.REACHED, Actor.ROBOT)
    assert here.state.suspended == ()


def test_what_is_shown_of_an_object_that_is_asked_about_is_the_help() -> None:
    here = asked_about_the_pear()
    show_chicken(here, 20)
    here.motion_finished(DONE)
    here.look(table(30, chicken=LEFT))

    remark = here.observe_demonstration(shown('pear', RIGHT, LEFT, at=40))

    assert isinstance(remark, Remark)
    assert 'is the help I asked for in request 2' in remark.sentence
    assert here.answered(Reply.DONE_BY_HAND, 'pear') is None
    outcome = here.look(table(41, pear=LEFT))
    assert isinstance(outcome, Outcome)
    assert (outcome.decision_id, outcome.result, outcome.actor) == (2, Result.REACHED, Actor.HUMAN)


def test_two_questions_are_answered_in_any_order() -> None:
    here = asked_about_the_pear()
    here.settings = replace(here.settings, threshold=0.75)
    chicken = show_chicken(here, 20, OFFTABLE)
    assert chicken.kind is Kind.ASK_HUMAN
    assert [asked.object for asked in here.state.questions] == ['pear', 'chicken']

    first = here.answered(Reply.SKIP, 'pear')

    assert first is not None
    assert (first.decision_id, first.result, first.object) == (2, Result.SKIPPED, 'pear')
    assert [asked.object for asked in here.state.questions] == ['chicken']
    with pytest.raises(ValueError, match='an answer about pear'):
        here.answered(Reply.SKIP, 'pear')
    second = here.answered(Reply.SKIP)
    assert second is not None
    assert (second.decision_id, second.result) == (chicken.id, Result.SKIPPED)
    assert here.phase is Phase.IDLE
    assert here.state.questions == ()


def test_the_turn_that_an_answer_interrupts_goes_on() -> None:
    here = asked_about_the_pear()
    here.observe_demonstration(shown('chicken', RIGHT, LEFT, at=20))
    here.look(table(20, chicken=LEFT))
    here.answered(Reply.DONE_BY_HAND, 'pear')
    assert here.phase is Phase.CONFIRMING
    helped = here.look(table(21, pear=LEFT, chicken=LEFT))
    assert isinstance(helped, Outcome)
    assert helped.object == 'pear'
    assert here.phase is Phase.TURN
    here.observe_demonstration(shown('chicken', LEFT, RIGHT, at=25))
    decision = here.look(table(25, pear=LEFT))

    assert isinstance(decision, Decision)
    assert (decision.object, decision.kind, decision.id) == ('chicken', Kind.EXECUTE, 4)


def test_an_answer_waits_until_the_arm_is_free() -> None:
    here = asked_about_the_pear()
    decision = show_chicken(here, 20)
    refused = here.refusal('pear', Reply.TRY_ANYWAY)

    assert refused == (
        f'Decision {decision.id} on chicken is under way: answer request 2 when it has ended.'
    )
    with pytest.raises(ValueError, match='is under way'):
        here.answered(Reply.TRY_ANYWAY, 'pear')
    assert here.refusal('pear', Reply.SKIP) == ''
    skipped = here.answered(Reply.SKIP, 'pear')
    assert skipped is not None
    assert skipped.result is Result.SKIPPED
    assert here.phase is Phase.ACTING


def test_an_action_is_not_tried_where_the_object_has_left() -> None:
    here = asked_about_the_pear()
    here.look(table(12, settled=False, pear=LEFT))
    assert here.refusal('pear', Reply.TRY_ANYWAY) == ''
    here.look(table(13, pear=LEFT))

    assert here.refusal('pear', Reply.TRY_ANYWAY) == (
        'pear is LEFT now, no longer RIGHT as when I asked: answer request 2 by done or skip.'
    )
    assert here.refusal('pear', Reply.DONE_BY_HAND) == ''


def test_questions_outlive_a_jump_of_time() -> None:
    here = asked_about_the_pear()
    here.observe_demonstration(shown('chicken', RIGHT, LEFT, at=20))
    here.look(table(20, chicken=LEFT))
    here.look(table(1))

    assert here.phase is Phase.IDLE
    assert [asked.object for asked in here.state.questions] == ['pear']
