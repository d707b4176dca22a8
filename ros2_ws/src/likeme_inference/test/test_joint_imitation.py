"""A session that imitates goals over the whole table."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from session_values import ns, shown, table
from test_session import DONE

from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT, OFFTABLE, PUSH_LEFT, RIGHT, WORLD
from likeme_core.tabletop import Mode, State
from likeme_inference.decision_record import decision_record, rederive
from likeme_inference.session_inputs import InputKind, apply_input, read_heard
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import Goals, ImitationSettings, help_request
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import Phase, SessionState
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    MotionReport,
    ObjectGoal,
    Outcome,
    Remark,
    Reply,
    Result,
    TableGoal,
)
from likeme_inference.value_json import from_json, to_json, to_text

WAIT = 5.0


def session(**settings: object) -> ImitationSession:
    return ImitationSession(shipped(), ImitationSettings(goals=Goals.JOINT, **settings))


def joint(at: float, **goals: State) -> TableGoal:
    """Each object, RIGHT before, is wanted somewhere with p = 0.9."""
    wanted = tuple(
        ObjectGoal(name, RIGHT, tuple(0.9 if g == goal else 0.05 for g in WORLD.states))
        for name, goal in goals.items()
    )
    return TableGoal(ns(at), 'camera', ns(at - 10), wanted, WAIT, 'The person has stopped.')


def put_back(here: ImitationSession, at: float) -> Decision | Outcome | Remark | None:
    """The objects are RIGHT again; what follows when that has been so for the wait."""
    assert here.look(table(at)) is None
    assert here.look(table(at + WAIT - 0.1)) is None
    return here.look(table(at + WAIT))


def reach(here: ImitationSession, at: float, **states: State) -> Outcome:
    """The arm's motion is complete, and the table is then so."""
    here.motion_finished(replace(DONE, finished=ns(at)))
    outcome = here.look(table(at + 1, **states))
    assert isinstance(outcome, Outcome)
    return outcome


def test_what_it_can_do_comes_first_and_it_asks_once_for_the_rest() -> None:
    here = session(threshold=0.65)
    here.observe_table_goal(joint(20, pear=LEFT, lemon=LEFT, chicken=LEFT))
    assert here.look(table(21, pear=LEFT, lemon=LEFT, chicken=LEFT)) is None
    push = put_back(here, 30)
    assert isinstance(push, Decision)
    assert (push.object, push.kind, push.action) == ('chicken', Kind.EXECUTE, PUSH_LEFT)
    assert push.goal_posterior == (0.9, 0.05, 0.05)
    assert push.demonstration == ns(10)
    assert reach(here, 40, chicken=LEFT).result is Result.REACHED

    asking = here.look(table(42, chicken=LEFT))
    assert isinstance(asking, Decision)
    assert (asking.object, asking.kind) == ('pear', Kind.ASK_HUMAN)
    assert asking.also == (('lemon', LEFT),)
    assert help_request(asking).question.endswith(
        'I would ask likewise for the lemon LEFT: please do that, too.'
    )
    record = json.loads(json.dumps(decision_record(here, asking)))
    assert rederive(record, WORLD) == []
    assert here.look(table(50, chicken=LEFT)) is None

    here.answered(Reply.DONE_BY_HAND)
    everything = {'pear': LEFT, 'lemon': LEFT, 'chicken': LEFT}
    outcome = here.look(table(51, **everything))
    assert isinstance(outcome, Outcome)
    assert outcome.result is Result.REACHED
    end = here.look(table(52, **everything))
    assert isinstance(end, Remark)
    assert end.sentence == 'I have done what I can for the goal that was shown.'
    assert here.look(table(60)) is None


def test_each_object_has_one_turn() -> None:
    here = session(threshold=0.0)
    here.observe_table_goal(joint(20, chicken=LEFT, lemon=LEFT))
    first = put_back(here, 30)
    assert isinstance(first, Decision)
    assert reach(here, 40).result is Result.MISSED
    second = here.look(table(42))
    assert isinstance(second, Decision)
    assert second.object != first.object
    assert reach(here, 50).result is Result.MISSED
    assert isinstance(here.look(table(52)), Remark)
    assert here.look(table(53)) is None


def test_in_sequential_mode_an_object_is_tried_again() -> None:
    here = session(mode=Mode.SEQUENTIAL, threshold=0.0, action_budget=2)
    here.observe_table_goal(joint(20, chicken=LEFT))
    first = put_back(here, 30)
    assert isinstance(first, Decision)
    reach(here, 40)
    again = here.look(table(42))
    assert isinstance(again, Decision)
    assert (first.actions_left, again.actions_left) == (2, 1)
    assert again.goal_posterior == first.goal_posterior == (0.9, 0.05, 0.05)


def test_an_action_that_is_not_free_leads_to_another_one() -> None:
    here = session()
    here.observe_table_goal(joint(20, chicken=LEFT))
    put_back(here, 30)
    here.motion_finished(MotionReport(MotionOutcome.NOT_FREE, 'The pear is in it.'))
    again = here.look(table(36))
    assert isinstance(again, Decision)
    assert again.blocked is not None
    assert again.goal_posterior == (0.9, 0.05, 0.05)


def test_a_goal_that_is_named_ends_the_objects_turn() -> None:
    here = session(threshold=1.0)
    here.observe_table_goal(joint(20, pear=LEFT))
    assert isinstance(put_back(here, 30), Decision)
    here.answered(Reply.NAME_GOAL, 'pear', RIGHT)
    there = here.look(table(36))
    assert isinstance(there, Decision)
    assert there.kind is Kind.AT_GOAL
    assert isinstance(here.look(table(37)), Remark)
    assert here.look(table(38)) is None


def test_putting_back_by_hand_is_no_new_goal() -> None:
    here = session()
    here.look(table(19, chicken=LEFT))
    here.observe_table_goal(joint(20, chicken=LEFT))
    here.look(table(30))
    undone = replace(joint(35, chicken=RIGHT), demonstration=ns(29))
    remark, decision = apply_input(here, undone)
    assert isinstance(remark, Remark)
    assert remark.sentence == 'The objects are back where they were: my turn.'
    assert isinstance(decision, Decision)
    assert decision.goal == LEFT


def test_it_is_known_from_where_an_object_was_taken() -> None:
    here = session()
    (wanted,) = joint(20, chicken=OFFTABLE).goals
    here.observe_table_goal(
        replace(joint(20, chicken=OFFTABLE), goals=(replace(wanted, x_i=LEFT),))
    )
    assert isinstance(put_back(here, 30), Decision)
    demo = here.state.demonstration
    assert demo is not None
    assert (demo.x_i, demo.x_f) == (LEFT, OFFTABLE)


def test_another_demonstration_replaces_the_goal() -> None:
    here = session()
    here.observe_table_goal(joint(20, chicken=LEFT))
    here.look(table(30, chicken=OFFTABLE, lemon=LEFT))
    here.observe_table_goal(replace(joint(35, lemon=LEFT), demonstration=ns(29)))
    decision = put_back(here, 40)
    assert isinstance(decision, Decision)
    assert decision.object == 'lemon'


def test_what_a_person_does_to_help_is_no_new_goal() -> None:
    here = session(threshold=1.0)
    here.observe_table_goal(joint(20, pear=LEFT))
    asking = put_back(here, 30)
    assert isinstance(asking, Decision)
    here.answered(Reply.DONE_BY_HAND)
    here.look(table(41, pear=LEFT))
    here.look(table(42, pear=LEFT))
    remark = here.observe_table_goal(replace(joint(46, pear=LEFT), demonstration=ns(39)))
    assert remark.sentence == 'What was done last belongs to the decision that is over.'
    assert here.look(table(60)) is None


def test_nobody_puts_the_objects_back() -> None:
    here = session(turn_timeout=60)
    here.observe_table_goal(joint(20, pear=LEFT))
    assert here.look(table(80, pear=LEFT)) is None
    remark = here.look(table(80.1, pear=LEFT))
    assert isinstance(remark, Remark)
    assert remark.sentence == 'Nobody put the objects back within 60 s: I let it be.'
    assert here.look(table(81)) is None


def test_demonstrations_are_believed_and_not_imitated_alone() -> None:
    here = session()
    assert isinstance(here.observe_demonstration(shown('pear', RIGHT, LEFT, at=3)), GoalBelief)
    assert here.look(table(20)) is None
    assert here.phase is Phase.IDLE


def test_it_outlives_a_restart_and_is_replayed() -> None:
    here = session()
    goal = joint(20, chicken=LEFT)
    heard = type('Heard', (), {'message': to_text(to_json(goal))})
    assert read_heard(InputKind.TABLE_GOAL, heard, WORLD) == goal
    here.observe_table_goal(goal)
    kept = from_json(SessionState, json.loads(json.dumps(to_json(here.state))), WORLD)
    assert kept.table == goal


def test_trajectory_imitation_has_no_joint_goals() -> None:
    with pytest.raises(ValueError, match='got trajectory'):
        session(mode=Mode.TRAJECTORY)
