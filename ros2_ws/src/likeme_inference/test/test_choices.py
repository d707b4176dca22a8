"""Edges of choosing: ties, the threshold, what is out of reach, what was never tried."""

from __future__ import annotations

import math

import numpy as np
import pytest

from likeme_inference.tabletop.action_selection import Choice, Kind, asks, choose
from likeme_inference.tabletop.domain import Action, Manner, Mode, State
from likeme_inference.tabletop.goal_inference import (
    direct_policy,
    goal_posterior,
    map_goal,
    map_index,
)
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.transition_model import TransitionModel

PEAR = shipped().objects['pear']
UNTRIED = TransitionModel(np.zeros((3, 6, 3), dtype=np.int64))
L, R, O = State  # noqa: E741


def make(model: TransitionModel, x_i: State, goal: State, mode: Mode, tau: float = 0.5) -> Choice:
    return choose(model, x_i, goal, Action.of(Manner.PLACE, goal), mode, tau)


def test_actions_know_manner_and_target() -> None:
    assert [action.target for action in Action] == [L, R, O, L, R, O]
    assert all(Action.of(action.manner, action.target) is action for action in Action)


def test_ties_go_to_the_preferred_then_to_the_lowest() -> None:
    assert map_index([0.2, 0.4, 0.4]) == 1
    assert map_index([0.2, 0.4, 0.4 - 1e-14], prefer=(2,)) == 2
    assert map_index([0.2, 0.4, 0.3], prefer=(2,)) == 1


def test_a_change_the_robot_cannot_explain_leaves_the_prior_and_its_end_is_the_goal() -> None:
    policy = direct_policy(PEAR.transition)
    posterior = goal_posterior(PEAR.transition, policy, O, R, [0.3, 0.3, 0.4])

    assert posterior.tolist() == [0.3, 0.3, 0.4]
    assert map_goal([1 / 3] * 3, R) == R


def test_exactly_at_the_threshold_is_sure_enough() -> None:
    assert not asks(0.5, 0.5)
    assert asks(math.nextafter(0.5, 0), 0.5)
    assert make(PEAR, R, L, Mode.INTERACTIVE, 0.4).kind is Kind.EXECUTE


@pytest.mark.parametrize('mode', Mode)
def test_at_the_goal_nothing_moves(mode: Mode) -> None:
    made = make(PEAR, R, R, mode)

    assert (made.kind, made.action, made.predicted) == (Kind.AT_GOAL, None, ())


@pytest.mark.parametrize('goal', [L, R])
@pytest.mark.parametrize('model', [PEAR, UNTRIED])
def test_off_the_table_is_out_of_reach(goal: State, model: TransitionModel) -> None:
    kinds = [make(model, O, goal, mode, 0.0).kind for mode in Mode]

    assert kinds == [Kind.NO_ACTION, Kind.NO_ACTION, Kind.ASK_HUMAN]
    assert make(model, O, goal, Mode.INTERACTIVE).action == Action.of(Manner.PLACE, goal)


def test_off_the_table_every_action_is_hopeless() -> None:
    made = make(PEAR, O, R, Mode.INTERACTIVE)

    assert made.action_probability == made.success_probability == (0.0,) * 6
    assert (made.predicted, made.predicted_success) == ((0.0, 0.0, 1.0), 0.0)


def test_trajectory_repeats_even_what_never_worked() -> None:
    made = make(PEAR, R, L, Mode.TRAJECTORY)

    assert (made.kind, made.action) == (Kind.EXECUTE, Action.PLACE_LEFT)
    assert made.predicted_success == 0


def test_never_tried_is_uniform() -> None:
    assert np.all(UNTRIED.transition == 1 / 3)
    assert not UNTRIED.tried.any()
    made = make(UNTRIED, L, R, Mode.GOAL_BASED)
    assert (made.kind, made.action) == (Kind.EXECUTE, Action.PLACE_RIGHT)


@pytest.mark.parametrize(
    ('counts', 'message'),
    [
        (np.zeros((3, 6)), r'shape \[x_i, a, x_f\], got \(3, 6\)'),
        (np.zeros((3, 6, 2), dtype=int), r'got \(3, 6, 2\)'),
        (np.full((3, 6, 3), 0.5), 'whole counts of 0 or more, got float64'),
        (np.full((3, 6, 3), -1), 'down to -1'),
    ],
)
def test_counts_that_are_none(counts: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TransitionModel(counts)


def test_models_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match='read-only'):
        PEAR.counts[0, 0, 0] = 1
