"""The order of trials on a table that people set up: people last, and for all objects at once."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from likeme_core.paper_world import (
    LEFT,
    OFFTABLE,
    PLACE_LEFT,
    PLACE_OFFTABLE,
    PLACE_RIGHT,
    PUSH_LEFT,
    PUSH_OFFTABLE,
    PUSH_RIGHT,
    RIGHT,
    WORLD,
)
from likeme_core.tabletop import State
from likeme_inference.experience.reset_planning import (
    MOTION_COST,
    Reset,
    ResetStep,
    TrialStep,
    TrialsWanted,
    next_step,
    reset_costs,
)
from likeme_inference.experience.trial import Counts, Pair, no_counts

BOTH = 'pear', 'lemon'


def missing(*pairs: Pair) -> dict[str, NDArray[np.int64]]:
    """One trial of each pair is missing."""
    found = {name: np.zeros((3, 6), dtype=np.int64) for name in BOTH}
    for name, x_i, action in pairs:
        found[name][x_i, action] += 1
    return found


def counts(*trials: tuple[Pair, State, int]) -> Counts:
    """So many trials of each pair that ended in a state."""
    found = no_counts(WORLD, BOTH)
    for (name, x_i, action), x_f, n in trials:
        found[name][x_i, action, x_f] = n
    return found


def step(
    wanted: Iterable[Pair],
    pear: State | None,
    lemon: State | None = OFFTABLE,
    known: Counts | None = None,
    blocked: Iterable[Pair] = (),
    in_vain: Iterable[Pair] = (),
    left: Iterable[Reset] = (),
) -> TrialStep | ResetStep | None:
    """The next step of the paper's world."""
    seen: Mapping[str, State | None] = {'pear': pear, 'lemon': lemon}
    state = TrialsWanted(
        missing(*wanted),
        seen,
        known or counts(),
        frozenset(blocked),
        frozenset(in_vain),
        frozenset(left),
    )
    return next_step(WORLD, state, np.random.default_rng(1))


def test_a_trial_that_ends_out_of_reach_waits_for_the_others() -> None:
    stays, falls = Pair('pear', LEFT, PLACE_LEFT), Pair('pear', LEFT, PUSH_RIGHT)
    known = counts((stays, LEFT, 5), (falls, OFFTABLE, 5))
    assert step([falls, stays], LEFT, known=known) == TrialStep(stays, True)
    # Also for those of another object.
    other = Pair('lemon', RIGHT, PLACE_RIGHT)
    assert step([falls, other], LEFT, RIGHT, known) == TrialStep(other, True)
    assert step([falls], LEFT, RIGHT, known) == TrialStep(falls, True)


def test_the_robot_brings_an_object_to_where_trials_are_wanted() -> None:
    wanted = [Pair('pear', RIGHT, PLACE_RIGHT)]
    found = step(wanted, LEFT)
    assert isinstance(found, TrialStep)
    assert not found.wanted
    assert found.pair in (Pair('pear', LEFT, PLACE_RIGHT), Pair('pear', LEFT, PUSH_RIGHT))
    # What is known to fail is not tried, and a person is asked when nothing works.
    place, push = Pair('pear', LEFT, PLACE_RIGHT), Pair('pear', LEFT, PUSH_RIGHT)
    only_push = counts((place, OFFTABLE, 20))
    assert step(wanted, LEFT, known=only_push) == TrialStep(push, False)
    neither = counts((place, OFFTABLE, 40), (push, LEFT, 40))
    assert step(wanted, LEFT, known=neither) == ResetStep((Reset('pear', RIGHT),))


def test_what_left_the_object_where_it_is_comes_last_and_moves_it_nowhere() -> None:
    place, push = Pair('pear', LEFT, PLACE_RIGHT), Pair('pear', LEFT, PUSH_RIGHT)
    assert step([place, push], LEFT, in_vain=[place]) == TrialStep(push, True)
    assert step([place], LEFT, in_vain=[place]) == TrialStep(place, True)
    wanted = [Pair('pear', RIGHT, PLACE_RIGHT)]
    assert step(wanted, LEFT, in_vain=[place]) == TrialStep(push, False)
    asked = ResetStep((Reset('pear', RIGHT),))
    # Other actions seldom bring it there.
    assert step(wanted, LEFT, known=counts((place, RIGHT, 9)), in_vain=[place, push]) == asked


def test_trials_off_the_table_are_made_when_an_object_is_there() -> None:
    off, on = Pair('pear', OFFTABLE, PLACE_LEFT), Pair('pear', LEFT, PLACE_LEFT)
    assert step([off, on], OFFTABLE) == TrialStep(off, True)
    # Nothing brings it there for them alone while others are wanted.
    assert step([off, on], LEFT) == TrialStep(on, True)
    assert step([off, on], RIGHT) in (
        TrialStep(Pair('pear', RIGHT, PLACE_LEFT), False),
        TrialStep(Pair('pear', RIGHT, PUSH_LEFT), False),
    )
    assert step([off], LEFT) in (
        TrialStep(Pair('pear', LEFT, PLACE_OFFTABLE), False),
        TrialStep(Pair('pear', LEFT, PUSH_OFFTABLE), False),
    )


def test_resets_are_asked_for_together_and_last() -> None:
    wanted = [Pair('pear', LEFT, PLACE_LEFT), Pair('lemon', RIGHT, PLACE_RIGHT)]
    assert step(wanted, OFFTABLE, RIGHT) == TrialStep(wanted[1], True)
    both = Reset('pear', LEFT), Reset('lemon', RIGHT)
    assert step(wanted, OFFTABLE, OFFTABLE) == ResetStep(both)
    # Also of an object that the camera does not see.
    assert step(wanted, None, OFFTABLE) == ResetStep(both)
    assert step(wanted, OFFTABLE, OFFTABLE, left=both[:1]) == ResetStep(both[1:])
    assert step(wanted, OFFTABLE, OFFTABLE, left=both) is None
    assert step([], LEFT, RIGHT) is None


def test_a_person_is_asked_for_the_state_of_trials_that_need_no_further_reset() -> None:
    falls = [Pair('pear', RIGHT, action) for action in (PLACE_OFFTABLE, PUSH_OFFTABLE)]
    stays = Pair('pear', LEFT, PLACE_LEFT)
    known = counts(*((pair, OFFTABLE, 10) for pair in falls), (stays, LEFT, 10))
    assert step([*falls, stays], OFFTABLE, known=known) == ResetStep((Reset('pear', LEFT),))
    assert step(falls, OFFTABLE, known=known) == ResetStep((Reset('pear', RIGHT),))


def test_a_blocked_pair_waits_and_then_a_person_makes_room() -> None:
    blocked, other = Pair('pear', LEFT, PLACE_RIGHT), Pair('lemon', LEFT, PLACE_LEFT)
    assert step([blocked, other], LEFT, LEFT, blocked=[blocked]) == TrialStep(other, True)
    asked = step([blocked], LEFT, LEFT, blocked=[blocked])
    assert asked == ResetStep((Reset('pear', LEFT),))


def test_costs_are_those_of_the_best_of_all_stationary_policies() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        transition = rng.dirichlet(np.full(3, 0.4), size=(3, 6))
        possible = rng.random((3, 6)) < 0.8
        wanted = np.array([True, False, False])
        costs = reset_costs(wanted, transition, possible)
        best = np.full(3, np.inf)
        # An action for each other state, or -1: ask.
        for chosen in itertools.product(range(-1, 6), repeat=2):
            if any(a >= 0 and not possible[x, a] for x, a in enumerate(chosen, start=1)):
                continue
            follows, paid = np.zeros((3, 3)), np.zeros(3)
            for x, a in enumerate(chosen, start=1):
                follows[x] = transition[x, a] if a >= 0 else 0
                paid[x] = MOTION_COST if a >= 0 else 1.0
            best = np.minimum(best, np.linalg.solve(np.eye(3) - follows, paid))
        np.testing.assert_allclose(costs, best, atol=1e-3)
