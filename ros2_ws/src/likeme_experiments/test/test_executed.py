"""Executed imitation: intervals against their definitions, forecasts against enumeration."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy import stats

from likeme_core.tabletop import Action, Manner, Mode, State
from likeme_experiments.evaluation.episode import Act, Ending, Episode
from likeme_experiments.evaluation.executed import (
    checked,
    difference,
    error_of,
    later_actions,
    reliability,
    score,
)
from likeme_experiments.evaluation.forecast import BUDGET, Case, Way, forecasts
from likeme_experiments.evaluation.intervals import (
    Interval,
    calibration_error,
    exact_interval,
    predictive_interval,
)
from likeme_experiments.evaluation.sequential import sequential
from likeme_experiments.evaluation.table1 import MODES, table1
from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.planning import plan, spread

LEFT, RIGHT, OFF = State
CASE = Case('pear', LEFT, RIGHT, Manner.PLACE)


@pytest.mark.parametrize(('successes', 'tries'), [(0, 5), (3, 20), (13, 20), (20, 20), (77, 80)])
def test_the_exact_interval_leaves_the_tails_that_it_says(successes: int, tries: int) -> None:
    low, high = exact_interval(successes, tries)
    if successes:
        assert stats.binom.sf(successes - 1, tries, low) == pytest.approx(0.025)
    if successes < tries:
        assert stats.binom.cdf(successes, tries, high) == pytest.approx(0.025)
    assert (low == 0.0) == (successes == 0)
    assert (high == 1.0) == (successes == tries)


@pytest.mark.parametrize('bad', [(-1, 3), (4, 3), (0, 0)])
def test_what_cannot_be_counted_is_refused(bad: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match='Expected'):
        exact_interval(*bad)
    with pytest.raises(ValueError, match='Expected 1 try'):
        predictive_interval(np.ones(3), 0)
    with pytest.raises(ValueError, match='Expected 1 try'):
        calibration_error([0.5], [0.5], [0])


@pytest.mark.parametrize(('a', 'b'), [(4.09, 6.18), (9.09, 1.18), (0.09, 10.18)])
def test_the_predictive_interval_of_a_row_is_the_beta_binomial_s(a: float, b: float) -> None:
    worlds = np.random.default_rng(0).beta(a, b, 200_000)
    law = stats.betabinom(20, a, b)
    expected = law.ppf(0.025) / 20, law.ppf(0.975) / 20
    assert predictive_interval(worlds, 20) == pytest.approx(expected, abs=0.051)
    low, high = predictive_interval(worlds, 20)
    assert law.cdf(20 * high) - law.cdf(20 * low - 1) >= 0.949


def test_who_is_certain_expects_one_share_only() -> None:
    assert predictive_interval(np.ones(10), 20) == Interval(1.0, 1.0)
    assert predictive_interval(np.zeros(10), 20) == Interval(0.0, 0.0)
    assert not Interval(1.0, 1.0).holds(0.95)


def test_the_calibration_error_by_hand() -> None:
    # One bin is right on average, the other off by 0.2; the second holds a quarter of the tries.
    assert calibration_error(
        [0.5, 0.55, 0.9], [0.35, 0.70, 0.7], [15, 15, 10]
    ) == pytest.approx(0.25 * 0.2)  # fmt: skip


def test_forecasts_are_table_1_and_the_exact_values_of_plans() -> None:
    model = shipped()
    cases = [
        Case(name, x_i, x_f, manner)
        for manner, name in product(Manner, model.objects)
        for x_i, x_f in product((LEFT, RIGHT), State)
        if x_i != x_f
    ]
    expected = forecasts(model, cases, np.random.default_rng(0), worlds=50)
    success = table1(model).success
    plans = [row for row in sequential(model) if row.actions == BUDGET]
    for (m, manner), (o, name) in product(enumerate(Manner), enumerate(model.objects)):
        mine = [c for c in cases if (c.manner, c.object) == (manner, name)]

        def mean(way: Way, cases: list[Case] = mine) -> float:
            return float(np.mean([expected[c, way].success for c in cases]))

        for k, mode in enumerate(MODES):
            assert mean(Way(mode.value)) == pytest.approx(success[m, o, k])
        assert mean(Way.SEQUENTIAL) == pytest.approx(plans[o].success)
        assert mean(Way.SEQUENTIAL_WITH_HELP) == 1.0
        helps = [expected[c, Way.SEQUENTIAL_WITH_HELP].help_rate for c in mine]
        assert np.mean(helps) == pytest.approx(plans[o].help_rate)


def test_following_a_plan_is_what_enumeration_says() -> None:
    rng = np.random.default_rng(3)
    worlds = rng.dirichlet(np.ones(3), size=(4, 3, 6))
    best = plan(worlds[0], TABLETOP.goal_matrix[RIGHT] > 0, 2, TABLETOP.stuck)
    ends = spread(worlds, best, LEFT, 2)[:, 2]
    for world, found in zip(worlds, ends, strict=True):
        total = np.zeros(3)
        for x in State:
            p = world[LEFT, best.action[2, LEFT], x]
            a = best.action[1, x]
            total += p * (np.eye(3)[x] if a < 0 else world[x, a])
        assert found == pytest.approx(total)


def episode(
    seed: int, trajectory: State, three: tuple[State, ...], helped: State | None
) -> Episode:
    place, push = Action.PLACE_RIGHT, Action.PUSH_RIGHT
    several = Ending((push,) * len(three), three, three[-1] != RIGHT, helped)
    endings = {
        Mode.TRAJECTORY: Ending((place,), (trajectory,), False),
        Mode.GOAL_BASED: Ending((push,), three[:1], False),
        Mode.INTERACTIVE: Ending((push,), three[:1], False),
        Mode.SEQUENTIAL: several,
    }
    return Episode(CASE, seed, (Act(LEFT, RIGHT, Manner.PLACE),), {'ml': endings})


STORY = [
    episode(0, LEFT, (RIGHT,), None),
    episode(1, RIGHT, (LEFT, RIGHT), None),
    episode(2, LEFT, (LEFT, LEFT, LEFT), RIGHT),
    # Nobody saw what was shown.
    Episode(CASE, 3, (), {'ml': {}}),
]


def predicted(name: str, x_i: int, action: int, x_f: int) -> float:
    return float(shipped().objects[name].transition[x_i, action, x_f])


def test_episodes_are_counted_as_they_went() -> None:
    expected = forecasts(shipped(), [CASE], np.random.default_rng(0))
    reached = {way: score(STORY, 'ml', way, expected).successes for way in Way}
    assert list(reached.values()) == [1, 1, 1, 2, 3]
    helped = score(STORY, 'ml', Way.SEQUENTIAL_WITH_HELP, expected)
    assert (helped.helped, helped.tries) == (0.25, 4)
    assert [e.understood for e in STORY] == [True, True, True, False]
    gain = difference(STORY, 'ml', Way.SEQUENTIAL, Way.TRAJECTORY)
    assert gain.mean == 0.25
    assert gain.error == pytest.approx(np.std([1, 0, 0, 0]) / 2)


def test_an_action_that_several_modes_took_is_one_try() -> None:
    place, push = reliability(STORY, 'ml', predicted)
    assert (place.action, place.successes, place.tries) == (Action.PLACE_RIGHT, 1, 3)
    assert (push.action, push.successes, push.tries) == (Action.PUSH_RIGHT, 1, 3)
    assert (place.predicted, push.predicted) == (0.1, 1.0)
    assert error_of([place, push]) == pytest.approx((1 / 3 - 0.1) / 2 + (1 - 1 / 3) / 2)
    hoped, achieved, count = later_actions(STORY, 'ml', predicted)
    assert (hoped, achieved, count) == (1.0, pytest.approx(1 / 3), 3)


def test_cells_are_held_against_the_model_s_own_doubt() -> None:
    expected = forecasts(shipped(), [CASE], np.random.default_rng(0))
    cells = {cell.way: cell for cell in checked(STORY, 'ml', expected)}
    # One success of ten placed, one of four here; ten of ten pushed, and one of four here.
    assert cells[Way.TRAJECTORY].inside
    assert not cells[Way.GOAL_BASED].inside
    assert not any(cell.asks for cell in cells.values())
