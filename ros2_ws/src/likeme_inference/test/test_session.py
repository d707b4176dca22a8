"""The imitation session without ROS: inputs, phases, decisions, outcomes."""

from __future__ import annotations

import dataclasses
import math

import pytest
from session_values import ns, shown, table

from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.paper_world import PLACE_LEFT, PUSH_LEFT, WORLD
from likeme_core.tabletop import Manner, Mode, State
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import ImitationSettings, help_request
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import Phase
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    MotionReport,
    Outcome,
    Remark,
    Reply,
    Result,
)

L, R, O = WORLD.states  # noqa: E741
DONE = MotionReport(MotionOutcome.COMPLETED, 'Pushed.', ns(20))


def session(mode: Mode = Mode.INTERACTIVE, **settings: float) -> ImitationSession:
    return ImitationSession(shipped(), ImitationSettings(mode=mode, **settings))


def show_and_put_back(here: ImitationSession, name: str, x_i: State, x_f: State) -> Decision:
    """Demonstrate a change, put the object back; the decision that follows."""
    here.observe_demonstration(shown(name, x_i, x_f, at=3))
    here.look(table(3, **{name: x_f}))
    here.observe_demonstration(shown(name, x_f, x_i, at=9))
    decision = here.look(table(9, **{name: x_i}))
    assert isinstance(decision, Decision)
    return decision


def test_demonstration_to_reached_goal() -> None:
    here = session()
    belief = here.observe_demonstration(shown('chicken', R, L, at=3))
    at_goal = here.look(table(3, chicken=L))
    nothing = here.look(table(3.1, chicken=L))
    put_back = here.observe_demonstration(shown('chicken', L, R, at=9))
    decision = here.look(table(9, chicken=R))
    wait = here.motion_finished(DONE)
    too_early = here.look(table(20, chicken=R))
    rolling = here.look(table(20.5, settled=False, chicken=L))
    outcome = here.look(table(21, chicken=L))

    assert isinstance(belief, GoalBelief)
    assert (belief.goal, belief.model, belief.stamp) == (L, 'chung2015_robot 1', ns(3))
    assert belief.posterior == pytest.approx((0.8802214, 0.1197786, 0), abs=1e-7)
    assert isinstance(at_goal, Decision)
    assert (at_goal.kind, at_goal.action, at_goal.id) == (Kind.AT_GOAL, None, 1)
    assert isinstance(put_back, Remark)
    assert isinstance(decision, Decision)
    assert (decision.kind, decision.action, decision.id) == (Kind.EXECUTE, PUSH_LEFT, 2)
    assert (decision.stamp, decision.demonstration, decision.x_i) == (ns(9), ns(3), R)
    assert decision.predicted_success == 0.9
    assert nothing is wait is too_early is rolling is None
    assert isinstance(outcome, Outcome)
    assert (outcome.result, outcome.actor, outcome.x_f) == (Result.REACHED, Actor.ROBOT, L)
    assert (outcome.decision_id, outcome.stamp, outcome.motion) == (
        2,
        ns(21),
        MotionOutcome.COMPLETED,
    )
    assert here.look(table(30, chicken=R)) is None
    assert here.phase is Phase.IDLE


def test_a_reset_without_a_demonstration_leads_to_a_decision() -> None:
    here = session()
    here.observe_demonstration(shown('chicken', R, L, at=3))
    here.look(table(3, chicken=L))

    assert here.look(table(10, chicken=R)) is None
    assert here.look(table(10.4, chicken=R)) is None
    decision = here.look(table(10.5, chicken=R))

    assert isinstance(decision, Decision)
    assert decision.kind is Kind.EXECUTE


def test_an_unsettled_view_restarts_the_turn_delay() -> None:
    here = session()
    here.observe_demonstration(shown('chicken', R, L, at=3))
    views = [(10, True), (10.3, False), (10.4, True), (10.8, True)]

    assert [here.look(table(at, ok, chicken=R)) for at, ok in views] == [None] * 4


def test_a_view_before_the_demonstration_leads_to_no_decision() -> None:
    here = session(turn_delay=0)
    here.look(table(2.5, chicken=R))
    here.observe_demonstration(shown('chicken', R, L, at=3))

    assert here.look(table(2.5, chicken=R)) is None


def test_the_view_of_the_demonstration_s_own_frame_may_come_first() -> None:
    here = session()
    here.look(table(3, chicken=L))
    here.observe_demonstration(shown('chicken', R, L, at=3))
    decision = here.look_again()

    assert isinstance(decision, Decision)
    assert decision.kind is Kind.AT_GOAL


def test_look_again_without_a_view() -> None:
    assert session().look_again() is None


def test_pear_right_to_left_is_asked_about_and_done_by_hand() -> None:
    here = session()
    decision = show_and_put_back(here, 'pear', R, L)
    request = help_request(decision)
    helping = here.observe_demonstration(shown('pear', R, L, at=15))
    here.look(table(15, pear=L))
    after_answer = here.answered(Reply.DONE_BY_HAND)
    old_view = here.look(table(15, pear=L))
    outcome = here.look(table(15.1, pear=L))

    assert (decision.kind, decision.action) == (Kind.ASK_HUMAN, PUSH_LEFT)
    assert (request.id, request.action, request.predicted_success) == (2, PUSH_LEFT, 0.4)
    assert '0.40' in request.question
    assert isinstance(helping, Remark)
    assert after_answer is old_view is None
    assert isinstance(outcome, Outcome)
    assert (outcome.result, outcome.actor, outcome.action) == (Result.REACHED, Actor.HUMAN, None)
    assert math.isnan(outcome.predicted_success)


def test_help_that_is_reported_after_its_outcome_is_no_new_goal() -> None:
    here = session()
    show_and_put_back(here, 'pear', R, L)
    here.answered(Reply.DONE_BY_HAND)
    here.look(table(15, pear=L))

    assert isinstance(here.observe_demonstration(shown('pear', R, L, at=15.2)), Remark)
    assert here.phase is Phase.IDLE
    assert isinstance(here.observe_demonstration(shown('pear', L, R, at=20)), GoalBelief)


def test_skipped() -> None:
    here = session()
    show_and_put_back(here, 'pear', R, L)
    outcome = here.answered(Reply.SKIP)

    assert isinstance(outcome, Outcome)
    assert (outcome.result, outcome.actor, outcome.x_f) == (Result.SKIPPED, Actor.NOBODY, None)
    assert outcome.stamp == ns(9)


def test_try_anyway_executes_and_may_miss() -> None:
    here = session()
    show_and_put_back(here, 'pear', R, L)
    assert here.answered(Reply.TRY_ANYWAY) is None
    assert here.phase is Phase.ACTING
    here.motion_finished(DONE)
    outcome = here.look(table(21, pear=R))

    assert isinstance(outcome, Outcome)
    assert (outcome.result, outcome.actor, outcome.action) == (
        Result.MISSED, Actor.ROBOT, PUSH_LEFT,
    )  # fmt: skip
    assert outcome.predicted_success == 0.4


def test_trajectory_copies_the_manner() -> None:
    here = session(Mode.TRAJECTORY)
    here.observe_demonstration(shown('chicken', R, L, 3, Manner.PLACE))
    here.look(table(10))
    decision = here.look(table(11))

    assert isinstance(decision, Decision)
    assert (decision.kind, decision.action) == (Kind.EXECUTE, PLACE_LEFT)
    assert decision.predicted_success == 0.5


def test_off_the_table_interactive_asks_and_goal_based_leaves_it() -> None:
    for mode, kind, phase in [
        (Mode.INTERACTIVE, Kind.ASK_HUMAN, Phase.ASKING),
        (Mode.GOAL_BASED, Kind.NO_ACTION, Phase.IDLE),
        (Mode.TRAJECTORY, Kind.NO_ACTION, Phase.IDLE),
    ]:
        here = session(mode)
        here.observe_demonstration(shown('pear', L, R, at=3))
        here.look(table(10, pear=O))
        decision = here.look(table(11, pear=O))

        assert isinstance(decision, Decision)
        assert (decision.kind, here.phase) == (kind, phase)


def test_another_demonstration_replaces_the_belief() -> None:
    here = session()
    here.observe_demonstration(shown('chicken', R, L, at=3))
    here.look(table(3, chicken=L))
    belief = here.observe_demonstration(shown('lemon', R, O, at=8))
    at_goal = here.look(table(8, chicken=L, lemon=O))
    here.look(table(20, chicken=R, lemon=O))
    nothing = here.look(table(21, chicken=R, lemon=O))

    assert isinstance(belief, GoalBelief)
    assert isinstance(at_goal, Decision)
    assert (at_goal.object, at_goal.goal) == ('lemon', O)
    assert nothing is None


def test_going_on_with_the_same_object_is_a_new_goal() -> None:
    here = session()
    here.observe_demonstration(shown('chicken', R, L, at=3))
    belief = here.observe_demonstration(shown('chicken', L, O, at=8))

    assert isinstance(belief, GoalBelief)
    assert belief.goal is O


def test_put_back_too_late_is_a_new_goal() -> None:
    here = session()
    here.observe_demonstration(shown('chicken', R, L, at=3))

    assert isinstance(here.observe_demonstration(shown('chicken', L, R, at=63.1)), GoalBelief)


def test_turn_timeout() -> None:
    here = session()
    here.observe_demonstration(shown('chicken', R, L, at=3))
    here.look(table(3, chicken=L))

    assert isinstance(here.look(table(63.1, chicken=R)), Remark)
    assert here.look(table(70, chicken=R)) is None


def test_demonstrations_while_acting_are_ignored() -> None:
    here = session()
    show_and_put_back(here, 'chicken', R, L)

    late_report = here.observe_demonstration(shown('chicken', L, R, at=9.3))
    other = here.observe_demonstration(shown('lemon', R, L, at=15))

    assert isinstance(late_report, Remark)
    assert 'put back' in late_report.sentence
    assert isinstance(other, Remark)
    assert 'decision 2 on chicken' in other.sentence
    assert here.phase is Phase.ACTING


@pytest.mark.parametrize(
    'report',
    [
        MotionReport(None, 'the arm gave no answer within 60 s.'),
        MotionReport(MotionOutcome.BUSY, 'Another action is under way.'),
        MotionReport(MotionOutcome.OBJECT_NOT_SEEN, 'pear is not in view.'),
        MotionReport(MotionOutcome.EXPIRED, 'Too late.'),
    ],
)
def test_an_arm_that_did_not_move_failed(report: MotionReport) -> None:
    here = session()
    show_and_put_back(here, 'chicken', R, L)
    outcome = here.motion_finished(report)

    assert isinstance(outcome, Outcome)
    assert (outcome.result, outcome.motion) == (Result.ARM_FAILED, report.outcome)
    assert report.message in outcome.sentence
    assert (outcome.stamp, outcome.x_f, outcome.action) == (ns(9), None, PUSH_LEFT)


@pytest.mark.parametrize(
    'motion', [MotionOutcome.NOT_GRASPED, MotionOutcome.NO_IK_SOLUTION, MotionOutcome.HELD]
)
def test_after_a_partial_motion_the_camera_decides(motion: MotionOutcome) -> None:
    here = session()
    show_and_put_back(here, 'chicken', R, L)
    here.motion_finished(MotionReport(motion, 'Half.', ns(20)))
    outcome = here.look(table(21, chicken=L))

    assert isinstance(outcome, Outcome)
    assert (outcome.result, outcome.motion) == (Result.REACHED, motion)
    assert motion.name in outcome.sentence


def test_never_settled_is_not_seen() -> None:
    here = session()
    show_and_put_back(here, 'chicken', R, L)
    here.motion_finished(DONE)

    assert here.look(table(30, settled=False, chicken=L)) is None
    outcome = here.look(table(30.1, settled=False, chicken=L))

    assert isinstance(outcome, Outcome)
    assert (outcome.result, outcome.x_f) == (Result.NOT_SEEN, None)


def test_a_silent_camera_is_not_seen() -> None:
    here = session()
    show_and_put_back(here, 'chicken', R, L)
    here.motion_finished(DONE)

    assert here.nothing_seen().result is Result.NOT_SEEN


def test_a_time_jump_ends_the_turn() -> None:
    here = session()
    here.observe_demonstration(shown('chicken', R, L, at=103))
    here.look(table(104, chicken=L))

    assert here.look(table(103.5, chicken=R)) is None
    assert isinstance(here.look(table(1, chicken=R)), Remark)
    assert isinstance(here.observe_demonstration(shown('chicken', R, L, at=3)), GoalBelief)


def test_settings_and_model_apply_from_the_next_decision() -> None:
    here = session()
    here.observe_demonstration(shown('pear', R, L, at=3))
    here.settings = dataclasses.replace(here.settings, threshold=0.3)
    here.model = RobotModel('renamed', '2', shipped().sources, shipped().rows)
    here.look(table(10))
    decision = here.look(table(11))

    assert isinstance(decision, Decision)
    assert (decision.kind, decision.threshold, decision.model) == (Kind.EXECUTE, 0.3, 'renamed 2')


def without_pear() -> RobotModel:
    rows = tuple(row for row in shipped().rows if row.object != 'pear')
    return RobotModel('no_pear', '1', shipped().sources, rows)


def test_a_model_without_the_demonstrated_object_ends_the_turn() -> None:
    here = session()
    here.observe_demonstration(shown('pear', R, L, at=3))
    here.model = without_pear()
    dropped = here.look(table(11))

    assert isinstance(dropped, Remark)
    assert dropped.sentence == 'no_pear 1 has no trials of pear: its demonstration is dropped.'
    assert here.phase is Phase.IDLE
    assert here.look(table(12)) is None
    refused = here.observe_demonstration(shown('pear', R, L, at=13))
    assert isinstance(refused, Decision)
    assert (refused.kind, refused.action, refused.id) == (Kind.NO_ACTION, None, 1)
    assert (refused.goal, refused.goal_posterior) == (L, (1 / 3,) * 3)
    assert refused.sentence == (
        'I saw the pear being placed from RIGHT to LEFT, but no_pear 1 has no trials of it: '
        'not imitated, as no prior is set (concentration or prior).'
    )
    assert here.phase is Phase.IDLE
    assert isinstance(here.observe_demonstration(shown('lemon', R, L, at=16)), GoalBelief)


@pytest.mark.parametrize('prior', [{'concentration': 0.09}, {'prior': Prior.SHARED}])
def test_an_object_without_trials_is_inferred_by_a_prior(prior: dict[str, float]) -> None:
    here = session(**prior)
    here.model = without_pear()
    belief = here.observe_demonstration(shown('pear', R, L, at=3))
    here.look(table(3, pear=L))
    here.observe_demonstration(shown('pear', L, R, at=9))
    decision = here.look(table(9, pear=R))

    assert isinstance(belief, GoalBelief)
    assert isinstance(decision, Decision)
    assert belief.goal == decision.goal == L
    if 'concentration' in prior:
        # Every final state is equally likely.
        assert belief.posterior == (1 / 3,) * 3
        assert (decision.kind, decision.predicted_success) == (Kind.ASK_HUMAN, 1 / 3)
    else:
        assert belief.posterior[L] > 0.6
        assert (decision.kind, decision.action) == (Kind.EXECUTE, PUSH_LEFT)
        assert decision.predicted_success > 0.6


@pytest.mark.parametrize('phase', [Phase.ACTING, Phase.CONFIRMING])
def test_a_model_without_the_object_ends_a_sequence_after_the_action_under_way(
    phase: Phase,
) -> None:
    here = session(Mode.SEQUENTIAL, threshold=0.1)
    show_and_put_back(here, 'pear', R, L)
    if phase is Phase.ACTING:
        here.model = without_pear()
    here.motion_finished(DONE)
    here.model = without_pear()
    outcome = here.look(table(21, pear=R))
    dropped = here.look(table(22, pear=R))

    assert isinstance(outcome, Outcome)
    assert outcome.result is Result.MISSED
    assert isinstance(dropped, Remark)
    assert here.phase is Phase.IDLE


@pytest.mark.parametrize('reply', Reply)
def test_a_question_may_be_answered_after_the_model_lost_its_object(reply: Reply) -> None:
    here = session(Mode.SEQUENTIAL, threshold=1.0)
    show_and_put_back(here, 'pear', R, L)
    assert here.phase is Phase.ASKING
    here.model = without_pear()
    outcome = here.answered(reply, goal=O if reply is Reply.NAME_GOAL else None)
    if reply is Reply.TRY_ANYWAY:
        here.motion_finished(DONE)
    if reply is Reply.NAME_GOAL:
        assert here.named_belief() is None
        assert isinstance(here.look(table(21, pear=R)), Remark)
    outcome = outcome or here.look(table(21, pear=R))

    assert isinstance(outcome, Outcome)
    assert here.phase is Phase.IDLE
    assert here.look(table(22, pear=R)) is None


def test_calls_out_of_order_are_refused() -> None:
    here = session()

    with pytest.raises(ValueError, match='Expected the session in ACTING, got IDLE'):
        here.motion_finished(DONE)
    with pytest.raises(ValueError, match='Expected the session in ASKING, got IDLE'):
        here.answered(Reply.SKIP)
    with pytest.raises(ValueError, match='Expected the session in CONFIRMING, got IDLE'):
        here.nothing_seen()


@pytest.mark.parametrize(
    ('settings', 'message'),
    [
        ({'goal_prior': (0.5, 0.5)}, 'Expected 3 probabilities'),
        ({'goal_prior': (0.5, 0.6, -0.1)}, 'Expected 3 probabilities of 0 or more'),
        ({'goal_prior': (0.5, 0.4, math.nan)}, 'Expected 3 probabilities of 0 or more'),
        ({'goal_prior': (0.5, 0.4, 0.03)}, 'to sum to 1, got 0.93'),
        ({'threshold': 1.1}, 'threshold from 0 to 1, got 1.1'),
    ],
)
def test_invalid_settings_are_rejected(settings: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ImitationSettings(**settings)


def missed(here: ImitationSession, at: float, x_f: State, **motion: MotionOutcome) -> Outcome:
    """The motion ends and the object is observed elsewhere; the outcome."""
    here.motion_finished(
        MotionReport(motion.get('motion', MotionOutcome.COMPLETED), 'Done.', ns(at))
    )
    outcome = here.look(table(at + 0.1, lemon=x_f))
    assert isinstance(outcome, Outcome)
    assert outcome.result is Result.MISSED
    return outcome


def test_sequential_decides_again_after_a_miss() -> None:
    here = session(Mode.SEQUENTIAL, action_budget=2)
    first = show_and_put_back(here, 'lemon', R, L)
    missed(here, 12, R)
    second = here.look(table(12.2, lemon=R))
    missed(here, 15, R)
    asking = here.look(table(15.2, lemon=R))

    assert isinstance(second, Decision)
    assert isinstance(asking, Decision)
    assert [d.actions_left for d in (first, second, asking)] == [2, 1, 0]
    assert [d.kind for d in (first, second, asking)] == [
        Kind.EXECUTE, Kind.EXECUTE, Kind.ASK_HUMAN,
    ]  # fmt: skip
    assert [d.demonstration for d in (second, asking)] == [first.demonstration] * 2
    assert asking.sentence.endswith('and my actions are spent: I ask.')
    assert 'with 2 actions I get there with p = ' in first.sentence
    here.answered(Reply.TRY_ANYWAY)
    assert missed(here, 18, R).actor is Actor.ROBOT
    assert here.phase is Phase.IDLE


def test_sequential_asks_when_the_object_fell_off() -> None:
    here = session(Mode.SEQUENTIAL)
    show_and_put_back(here, 'lemon', R, L)
    missed(here, 12, O)
    asking = here.look(table(12.2, lemon=O))

    assert isinstance(asking, Decision)
    assert (asking.kind, asking.actions_left, asking.plan_value) == (Kind.ASK_HUMAN, 2, 0)
    assert 'out of my reach' in asking.sentence or 'below 0.50' in asking.sentence


def test_sequential_ends_when_the_object_rolled_to_the_goal_by_itself() -> None:
    here = session(Mode.SEQUENTIAL)
    show_and_put_back(here, 'lemon', R, L)
    missed(here, 12, R)
    at_goal = here.look(table(12.2, lemon=L))

    assert isinstance(at_goal, Decision)
    assert at_goal.kind is Kind.AT_GOAL
    assert here.phase is Phase.IDLE


def test_sequential_budget_restarts_with_every_demonstration() -> None:
    here = session(Mode.SEQUENTIAL, action_budget=2)
    show_and_put_back(here, 'lemon', R, L)
    missed(here, 12, R)
    here.observe_demonstration(shown('lemon', R, L, at=20))
    here.look(table(20, lemon=L))
    here.observe_demonstration(shown('lemon', L, R, at=25))
    decision = here.look(table(25, lemon=R))

    assert isinstance(decision, Decision)
    assert decision.actions_left == 2


@pytest.mark.parametrize('mode', [m for m in Mode if m is not Mode.SEQUENTIAL])
def test_other_modes_do_not_try_again(mode: Mode) -> None:
    here = session(mode)
    show_and_put_back(here, 'lemon', R, L)
    missed(here, 12, R)

    assert here.phase is Phase.IDLE


def test_sequential_ends_after_a_hold_or_a_failed_motion() -> None:
    held, failed = session(Mode.SEQUENTIAL), session(Mode.SEQUENTIAL)
    for here in (held, failed):
        show_and_put_back(here, 'lemon', R, L)
    missed(held, 12, R, motion=MotionOutcome.HELD)
    outcome = failed.motion_finished(MotionReport(None, 'It is gone.'))

    assert isinstance(outcome, Outcome)
    assert held.phase is failed.phase is Phase.IDLE
