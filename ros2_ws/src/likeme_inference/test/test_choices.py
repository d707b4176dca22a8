"""Limiting cases of action selection: ties, threshold, reach, rows without trials."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from likeme_core.paper_world import PLACE_LEFT, PLACE_RIGHT, PUSH_LEFT, WORLD
from likeme_core.tabletop import Manner, Mode, State
from likeme_inference.tabletop.action_selection import Choice, Kind, asks, choose
from likeme_inference.tabletop.asking import choose_least_cost
from likeme_inference.tabletop.cost_planning import Costs
from likeme_inference.tabletop.domain import TABLETOP, Policy
from likeme_inference.tabletop.goal_inference import goal_posterior, map_goal, map_index
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import GOAL_MODELS_KEPT
from likeme_inference.tabletop.transition_model import TransitionModel

PEAR = shipped().goal_model('pear')
UNTRIED = GoalModel.of(TransitionModel.untried(3, 6), TABLETOP)
L, R, O = WORLD.states  # noqa: E741


def make(
    model: GoalModel, x_i: State, goal: State, mode: Mode, tau: float = 0.5, left: int = 3
) -> Choice:
    return choose(model, x_i, goal, WORLD.action_of(Manner.PLACE, goal), mode, tau, left)


def test_actions_know_manner_and_target() -> None:
    assert [action.target for action in WORLD.actions] == [L, R, O, L, R, O]
    assert all(WORLD.action_of(action.manner, action.target) is action for action in WORLD.actions)


def test_ties_go_to_the_preferred_then_to_the_lowest() -> None:
    assert map_index([0.2, 0.4, 0.4]) == 1
    assert map_index([0.2, 0.4, 0.4 - 1e-14], prefer=(2,)) == 2
    assert map_index([0.2, 0.4, 0.3], prefer=(2,)) == 1


def test_a_change_the_robot_cannot_explain_leaves_the_prior_and_its_end_is_the_goal() -> None:
    prior = [0.3, 0.3, 0.4]
    posterior = goal_posterior(PEAR.transition, PEAR.policy, O, R, prior)

    assert posterior.tolist() == prior
    assert GoalModel.of(PEAR.transition, prior=prior).goal_posterior(O, R).tolist() == prior
    assert map_goal([1 / 3] * 3, R) == R


def test_exactly_at_the_threshold_is_sure_enough() -> None:
    assert not asks(0.5, 0.5)
    assert asks(0.5 - 1e-9, 0.5)
    assert not asks(math.nextafter(0.5, 0), 0.5), 'Sums are rounded.'
    assert make(PEAR, R, L, Mode.INTERACTIVE, 0.4).kind is Kind.EXECUTE


@pytest.mark.parametrize('mode', Mode)
def test_at_the_goal_nothing_moves(mode: Mode) -> None:
    made = make(PEAR, R, R, mode)

    assert (made.kind, made.action, made.predicted) == (Kind.AT_GOAL, None, ())


@pytest.mark.parametrize('goal', [L, R])
@pytest.mark.parametrize('model', [PEAR, UNTRIED])
def test_off_the_table_is_out_of_reach(goal: State, model: GoalModel) -> None:
    kinds = [make(model, O, goal, mode, 0.0).kind for mode in Mode]

    assert kinds == [Kind.NO_ACTION, Kind.NO_ACTION, Kind.ASK_HUMAN, Kind.ASK_HUMAN]
    assert make(model, O, goal, Mode.INTERACTIVE).action == WORLD.action_of(Manner.PLACE, goal)


def test_no_action_helps_off_the_table() -> None:
    made = make(PEAR, O, R, Mode.INTERACTIVE)

    assert made.action_probability == made.success_probability == (0.0,) * 6
    assert (made.predicted, made.predicted_success) == ((0.0, 0.0, 1.0), 0.0)


def test_trajectory_repeats_actions_without_success() -> None:
    made = make(PEAR, R, L, Mode.TRAJECTORY)

    assert (made.kind, made.action) == (Kind.EXECUTE, PLACE_LEFT)
    assert made.predicted_success == 0


def test_rows_without_trials_are_uniform() -> None:
    assert np.all(UNTRIED.transition == 1 / 3)
    assert not TransitionModel.untried(3, 6).tried.any()
    made = make(UNTRIED, L, R, Mode.GOAL_BASED)
    assert (made.kind, made.action) == (Kind.EXECUTE, PLACE_RIGHT)


def test_with_three_actions_the_pear_needs_no_help() -> None:
    once, thrice = (make(PEAR, R, L, Mode.SEQUENTIAL, left=n) for n in (1, 3))

    assert (once.kind, once.plan_value) == (Kind.ASK_HUMAN, 0.4)
    assert (thrice.kind, thrice.action, thrice.actions_left) == (
        Kind.EXECUTE, PUSH_LEFT, 3,
    )  # fmt: skip
    assert thrice.predicted_success == 0.4
    assert thrice.plan_value == max(thrice.plan_success) == pytest.approx(1 - 0.6**3)


def test_spent_actions_ask_even_at_threshold_zero() -> None:
    made = make(PEAR, R, L, Mode.SEQUENTIAL, 0.0, left=0)

    assert (made.kind, made.action) == (Kind.ASK_HUMAN, PUSH_LEFT)
    assert (made.plan_value, made.plan_success) == (0, (0.0,) * 6)
    assert make(PEAR, L, L, Mode.SEQUENTIAL, 0.0, left=0).plan_value == 1


def test_trajectory_needs_a_demonstrated_action() -> None:
    with pytest.raises(ValueError, match='demonstrated action to repeat, got None'):
        choose(PEAR, R, L, None, Mode.TRAJECTORY, 0.5)


@pytest.mark.parametrize(
    ('fields', 'message'),
    [
        ({'transition': np.zeros((3, 6, 2))}, r'transition of shape \(3, 6, 3\), got \(3, 6, 2\)'),
        ({'prior': [0.5, 0.5]}, r'prior of shape \(3,\), got \(2,\)'),
        ({'prior': [0.5, math.nan, 0.5]}, 'prior of 0 or more, got nan'),
        ({'demonstrator': np.full((4, 5, 4), 0.25)}, 'demonstrator of 3 states, got 4'),
        ({'transition': PEAR.transition + np.inf}, 'transition of 0 or more, got inf'),
        ({'goals': np.zeros((0, 3))}, r'goals of at least one of each, got shape \(0, 3\)'),
        ({'goals': np.eye(3) / 2}, 'goals of 0 or 1, got'),
        ({'demonstrator': PEAR.transition / 2}, r'demonstrator to sum to 1, got 0\.5'),
        ({'prior': [0.5, 0.25, 0.5]}, r'prior to sum to 1, got 1\.25'),
        ({'goals': np.eye(4)}, r'goals of shape \(4, 3\), got \(4, 4\)'),
    ],
)
def test_invalid_models_are_rejected(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        GoalModel.of(**{'transition': PEAR.transition} | fields)


def test_a_deterministic_demonstrator_intends_the_final_state() -> None:
    """The robot's pear rolls off the table now and then, and may have been meant elsewhere."""
    never_slips = np.eye(3)[None, [action.target for action in WORLD.actions]].repeat(3, axis=0)
    like_me, like_them = (
        GoalModel.of(PEAR.transition, demonstrator=other) for other in (None, never_slips)
    )

    assert like_me.goal_posterior(L, O) == pytest.approx([0.2038, 0.0124, 0.7838], abs=5e-5)
    assert like_them.goal_posterior(L, O).tolist() == [0, 0, 1]
    assert np.array_equal(like_them.policy, like_me.policy)


def test_without_a_domain_no_state_is_out_of_reach() -> None:
    nameless = GoalModel.of(PEAR.transition)

    assert make(nameless, O, R, Mode.SEQUENTIAL).plan_value == 0
    assert not nameless.stuck.any()
    with pytest.raises(ValueError, match=r'shape \(3, 6, 3\), as the domain has it, got'):
        GoalModel.of(np.eye(3)[:, None], TABLETOP)


def test_modes_and_policies_are_read_from_strings() -> None:
    for mode in Mode:
        assert make(PEAR, R, L, str(mode)) == make(PEAR, R, L, mode)  # type: ignore[arg-type]
    robot = shipped()
    explored = robot.goal_model('pear', policy='explored')  # type: ignore[arg-type]
    assert explored is robot.goal_model('pear', policy=Policy.EXPLORED)
    assert not np.array_equal(explored.policy, PEAR.policy)
    with pytest.raises(ValueError, match='nonsense'):
        make(PEAR, R, L, 'nonsense')  # type: ignore[arg-type]


def test_ties_of_goals_go_to_a_fulfilled_one() -> None:
    goals = np.array([[1.0, 0, 0, 0], [0, 0, 1, 1]])

    assert map_goal([0.5, 0.5], 3, goals) == 1
    assert map_goal([0.5, 0.5], 1, goals) == 0


def test_models_copy_their_arrays() -> None:
    transition = PEAR.transition.copy()
    model = GoalModel.of(transition)
    transition[:] = 0

    assert np.array_equal(model.goal_posterior(L, R), PEAR.goal_posterior(L, R))
    with pytest.raises(ValueError, match='read-only'):
        model.prior[0] = 1


@pytest.mark.parametrize(
    ('x_i', 'x_f', 'message'),
    [
        (-1, 0, 'x_i from 0 to 2, got -1'),
        (0, 3, 'x_f from 0 to 2, got 3'),
        (True, 0, 'x_i from 0 to 2, got True'),
        ([0, 1], [1, -1], 'x_f from 0 to 2, got -1'),
        (0, [True, False, True], 'x_f in whole numbers, got bool'),
        ([0.5, 0.5], 0, r'distributions over 3 states, got float64 of shape \(2,\)'),
        ([math.nan, 1.0, 0.0], 0, '0 or more, got nan'),
        ([math.inf, 1.0, 0.0], 0, '0 or more, got inf'),
        ([-0.5, 1.0, 0.5], [1.0, 0.0, 0.0], '0 or more, got -0.5'),
    ],
)
def test_invalid_evidence_is_rejected(x_i: Any, x_f: Any, message: str) -> None:
    for ask in (PEAR.goal_posterior, PEAR.action_posterior):
        with pytest.raises(ValueError, match=message):
            ask(x_i, x_f)


def test_invalid_numbers_are_rejected() -> None:
    for ask, message in [
        (lambda: PEAR.predict(-1, 0), 'x_i from 0 to 2, got -1'),
        (lambda: PEAR.predict([0.5, 0.5], 0), 'over 3 states'),
        (lambda: PEAR.predict(0, 6), 'a from 0 to 5, got 6'),
        (lambda: PEAR.action_for([math.nan, 0.5, 0.5], 0), '0 or more, got nan'),
        (lambda: PEAR.success(0, -1), 'g from 0 to 2, got -1'),
        (lambda: choose(PEAR, 3, 0, None, Mode.INTERACTIVE, 0.5), 'x_i from 0 to 2, got 3'),
        (lambda: choose(PEAR, 0, 1, -1, Mode.TRAJECTORY, 0.5), 'demonstrated from 0 to 5'),
        (lambda: choose(PEAR, 0, 1, None, Mode.INTERACTIVE, math.nan), 'threshold from 0 to 1'),
        (lambda: map_index([math.nan, 0.5]), 'probabilities, got'),
    ]:
        with pytest.raises(ValueError, match=message):
            ask()


def test_a_demonstrator_with_other_actions() -> None:
    """A person who can but drop things: all that is not OFFTABLE stays unexplained."""
    drops = np.zeros((3, 1, 3))
    drops[..., O] = 1
    model = GoalModel.of(PEAR.transition, demonstrator=drops)

    assert model.goal_posterior(L, O).tolist() == [0, 0, 1]
    assert model.goal_posterior(L, R).tolist() == [1 / 3] * 3
    assert model.action_for(R, L).shape == (6,)


@pytest.mark.parametrize(
    ('counts', 'message'),
    [
        (np.zeros((3, 6)), r'shape \[x_i, a, x_f\], got \(3, 6\)'),
        (np.zeros((3, 6, 2), dtype=int), r'got \(3, 6, 2\)'),
        (np.full((3, 6, 3), 0.5), 'whole counts of 0 or more, got float64'),
        (np.full((3, 6, 3), -1), 'down to -1'),
    ],
)
def test_invalid_counts_are_rejected(counts: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TransitionModel(counts)


def test_trials_can_only_be_added() -> None:
    pear = shipped().objects['pear']
    more = pear.add(R, PUSH_LEFT, L, times=2)

    assert (pear.trials, more.trials) == (180, 182)
    assert more.counts[R, PUSH_LEFT].tolist() == [6, 6, 0]
    assert pear.merge(more).trials == 362
    with pytest.raises(ValueError, match='at least 1 trial, got -1'):
        pear.add(R, PUSH_LEFT, L, times=-1)
    with pytest.raises(ValueError, match='a from 0 to 5, got 6'):
        pear.add(R, 6, L)
    with pytest.raises(ValueError, match=r'shape \(3, 6, 3\), got \(2, 6, 2\)'):
        pear.merge(TransitionModel.untried(2, 6))
    with pytest.raises(ValueError, match=r'prior 0\.0, got 0\.5'):
        pear.merge(TransitionModel.untried(3, 6, 0.5))
    for prior, message in [
        (-1, r'from 0 to 2\^53, got -1'),
        (math.nan, r'from 0 to 2\^53, got nan'),
        (np.ones(2), r'broadcasts to \(3, 6, 3\), got \(2,\)'),
    ]:
        with pytest.raises(ValueError, match=message):
            TransitionModel.untried(3, 6, prior)


def test_models_are_read_only() -> None:
    with pytest.raises(ValueError, match='read-only'):
        PEAR.transition[0, 0, 0] = 1
    prior = np.full((3, 6, 3), 0.5)
    counted = TransitionModel(shipped().objects['pear'].counts, prior)
    prior[:] = 100
    assert counted.pseudo_counts[L, 0].tolist() == [10.5, 0.5, 0.5]
    for array in (
        counted.counts, counted.prior, PEAR.success(L, R), TABLETOP.stuck, TABLETOP.goal_matrix,
        PEAR.goal_posterior(L, R), shipped().counted('pear', prior=Prior.SHARED).prior,
    ):  # fmt: skip
        with pytest.raises(ValueError, match='read-only'):
            array[...] = 1  # type: ignore[index]


def test_goal_models_of_the_latest_settings_are_kept_and_no_others() -> None:
    robot = shipped()
    first = robot.goal_model('pear')
    assert robot.goal_model('pear') is first
    for count in range(2 * GOAL_MODELS_KEPT):
        robot.goal_model('pear', concentration=1.0 + count)
    assert len(robot._goal_models) == GOAL_MODELS_KEPT
    anew = robot.goal_model('pear')
    assert anew is not first
    assert (anew.policy == first.policy).all()


@pytest.mark.parametrize('mode', [Mode.INTERACTIVE, Mode.SEQUENTIAL])
def test_a_kept_answer_is_the_answer_of_a_new_model(mode: Mode) -> None:
    robot = shipped()
    kept = robot.goal_model('pear')
    for left in (1, 3):
        for x_i in range(3):
            for goal in range(3):
                first = choose(kept, x_i, goal, None, mode, 0.5, left)
                again = choose(kept, x_i, goal, None, mode, 0.5, left)
                new = choose(shipped().goal_model('pear'), x_i, goal, None, mode, 0.5, left)
                # NaN differs from itself.
                assert repr(first) == repr(again) == repr(new)
    posterior = kept.goal_posterior(1, 0)
    for costs in (Costs(), Costs(help=0.05), Costs()):
        new = shipped().goal_model('pear')
        assert repr(choose_least_cost(kept, 1, 0, posterior, mode, costs, 3)) == repr(
            choose_least_cost(new, 1, 0, posterior, mode, costs, 3)
        )
