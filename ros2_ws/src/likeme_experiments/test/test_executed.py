"""Executed imitation: intervals against their definitions, forecasts against enumeration."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy import stats

from likeme_core.paper_world import LEFT, PLACE_RIGHT, PUSH_RIGHT, RIGHT, WORLD
from likeme_core.tabletop import Manner, Mode, State
from likeme_experiments.evaluation.episode import (
    ImitationEpisode,
    ImitationResult,
    PerceivedDemonstration,
)
from likeme_experiments.evaluation.executed import (
    calibration_error_of,
    difference,
    interval_checks,
    later_actions,
    reliability,
    score,
)
from likeme_experiments.evaluation.forecast import BUDGET, Approach, DemonstrationCase, forecasts
from likeme_experiments.evaluation.intervals import (
    ProportionInterval,
    calibration_error,
    exact_interval,
    predictive_interval,
)
from likeme_experiments.evaluation.sequential import sequential
from likeme_experiments.evaluation.table1 import MODES, table1
from likeme_experiments.reproductions.executed import refused_shares
from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.planning import plan, spread

CASE = DemonstrationCase('pear', LEFT, RIGHT, Manner.PLACE)


@pytest.mark.parametrize(('successes', 'tries'), [(0, 5), (3, 20), (13, 20), (20, 20), (77, 80)])
def test_the_exact_interval_has_the_nominal_tails(successes: int, tries: int) -> None:
    low, high = exact_interval(successes, tries)
    if successes:
        assert stats.binom.sf(successes - 1, tries, low) == pytest.approx(0.025)
    if successes < tries:
        assert stats.binom.cdf(successes, tries, high) == pytest.approx(0.025)
    assert (low == 0.0) == (successes == 0)
    assert (high == 1.0) == (successes == tries)


@pytest.mark.parametrize('bad', [(-1, 3), (4, 3), (0, 0)])
def test_impossible_counts_are_rejected(bad: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match='Expected'):
        exact_interval(*bad)
    with pytest.raises(ValueError, match='Expected 1 try'):
        predictive_interval(np.ones(3), 0)
    with pytest.raises(ValueError, match='Expected 1 try'):
        calibration_error([0.5], [0.5], [0])


@pytest.mark.parametrize(('a', 'b'), [(4.09, 6.18), (9.09, 1.18), (0.09, 10.18)])
def test_the_predictive_interval_of_a_row_is_beta_binomial(a: float, b: float) -> None:
    worlds = np.random.default_rng(0).beta(a, b, 200_000)
    law = stats.betabinom(20, a, b)
    expected = law.ppf(0.025) / 20, law.ppf(0.975) / 20
    assert predictive_interval(worlds, 20) == pytest.approx(expected, abs=0.051)
    low, high = predictive_interval(worlds, 20)
    assert law.cdf(20 * high) - law.cdf(20 * low - 1) >= 0.949


def test_a_certain_prediction_has_an_interval_of_one_value() -> None:
    assert predictive_interval(np.ones(10), 20) == ProportionInterval(1.0, 1.0)
    assert predictive_interval(np.zeros(10), 20) == ProportionInterval(0.0, 0.0)
    assert not ProportionInterval(1.0, 1.0).holds(0.95)


def test_the_calibration_error_of_an_example() -> None:
    # One bin is right on average, the other off by 0.2; the second holds a quarter of the tries.
    assert calibration_error(
        [0.5, 0.55, 0.9], [0.35, 0.70, 0.7], [15, 15, 10]
    ) == pytest.approx(0.25 * 0.2)  # fmt: skip


def test_forecasts_equal_table_1_and_the_exact_values_of_plans() -> None:
    model = shipped()
    cases = [
        DemonstrationCase(name, x_i, x_f, manner)
        for manner, name in product(WORLD.manners, model.objects)
        for x_i, x_f in product((LEFT, RIGHT), WORLD.states)
        if x_i != x_f
    ]
    expected = forecasts(WORLD, model, cases, np.random.default_rng(0), worlds=50)
    success = table1(model, WORLD).success
    plans = [row for row in sequential(model, WORLD) if row.actions == BUDGET]
    for (m, manner), (o, name) in product(enumerate(WORLD.manners), enumerate(model.objects)):
        mine = [c for c in cases if (c.manner, c.object) == (manner, name)]

        def mean(approach: Approach, cases: list[DemonstrationCase] = mine) -> float:
            return float(np.mean([expected[c, approach].success for c in cases]))

        for k, mode in enumerate(MODES):
            assert mean(Approach(mode.value)) == pytest.approx(success[m, o, k])
        assert mean(Approach.SEQUENTIAL) == pytest.approx(plans[o].success)
        assert mean(Approach.SEQUENTIAL_WITH_HELP) == 1.0
        helps = [expected[c, Approach.SEQUENTIAL_WITH_HELP].help_rate for c in mine]
        assert np.mean(helps) == pytest.approx(plans[o].help_rate)


def test_a_plan_has_the_success_of_its_enumeration() -> None:
    rng = np.random.default_rng(3)
    worlds = rng.dirichlet(np.ones(3), size=(4, 3, 6))
    best = plan(worlds[0], TABLETOP.goal_matrix[RIGHT] > 0, 2, TABLETOP.stuck)
    ends = spread(worlds, best, LEFT, 2)[:, 2]
    for world, found in zip(worlds, ends, strict=True):
        total = np.zeros(3)
        for x in WORLD.states:
            p = world[LEFT, best.action[2, LEFT], x]
            a = best.action[1, x]
            total += p * (np.eye(3)[x] if a < 0 else world[x, a])
        assert found == pytest.approx(total)


def episode(
    seed: int, trajectory: State, three: tuple[State, ...], helped: State | None
) -> ImitationEpisode:
    place, push = PLACE_RIGHT, PUSH_RIGHT
    several = ImitationResult((push,) * len(three), three, three[-1] != RIGHT, helped)
    endings = {
        Mode.TRAJECTORY: ImitationResult((place,), (trajectory,), False),
        Mode.GOAL_BASED: ImitationResult((push,), three[:1], False),
        Mode.INTERACTIVE: ImitationResult((push,), three[:1], False),
        Mode.SEQUENTIAL: several,
    }
    return ImitationEpisode(
        CASE, seed, (PerceivedDemonstration(LEFT, RIGHT, Manner.PLACE),), {'ml': endings}
    )


EPISODES = [
    episode(0, LEFT, (RIGHT,), None),
    episode(1, RIGHT, (LEFT, RIGHT), None),
    episode(2, LEFT, (LEFT, LEFT, LEFT), RIGHT),
    # Nobody saw what was shown.
    ImitationEpisode(CASE, 3, (), {'ml': {}}),
]


def test_the_share_of_refused_actions_is_of_all_actions_of_a_mode() -> None:
    refused = ImitationResult((PUSH_RIGHT,), (LEFT,), False, refused=1)
    crowded = ImitationEpisode(CASE, 4, (), {'ml': {Mode.GOAL_BASED: refused}})
    shares = refused_shares([*EPISODES, crowded], 'ml')
    assert shares == {'trajectory': 0, 'goal_based': 1 / 4, 'interactive': 0, 'sequential': 0}


def predicted(name: str, x_i: int, action: int, x_f: int) -> float:
    return float(shipped().objects[name].transition[x_i, action, x_f])


def test_scores_of_episodes() -> None:
    expected = forecasts(WORLD, shipped(), [CASE], np.random.default_rng(0))
    reached = {
        approach: score(EPISODES, 'ml', approach, expected).successes for approach in Approach
    }
    assert list(reached.values()) == [1, 1, 1, 2, 3]
    helped = score(EPISODES, 'ml', Approach.SEQUENTIAL_WITH_HELP, expected)
    assert (helped.helped, helped.tries) == (0.25, 4)
    assert [e.understood for e in EPISODES] == [True, True, True, False]
    gain = difference(EPISODES, 'ml', Approach.SEQUENTIAL, Approach.TRAJECTORY)
    assert gain.mean == 0.25
    assert gain.error == pytest.approx(np.std([1, 0, 0, 0]) / 2)


def test_an_action_that_several_modes_chose_is_one_try() -> None:
    place, push = reliability(EPISODES, 'ml', predicted, WORLD)
    assert (place.action, place.successes, place.tries) == (PLACE_RIGHT, 1, 3)
    assert (push.action, push.successes, push.tries) == (PUSH_RIGHT, 1, 3)
    assert (place.predicted, push.predicted) == (0.1, 1.0)
    assert calibration_error_of([place, push]) == pytest.approx(
        (1 / 3 - 0.1) / 2 + (1 - 1 / 3) / 2
    )
    hoped, achieved, count = later_actions(EPISODES, 'ml', predicted)
    assert (hoped, achieved, count) == (1.0, pytest.approx(1 / 3), 3)


def test_cells_are_checked_against_the_predictive_interval() -> None:
    expected = forecasts(WORLD, shipped(), [CASE], np.random.default_rng(0))
    cells = {cell.approach: cell for cell in interval_checks(EPISODES, 'ml', expected)}
    # One success of ten placed, one of four here; ten of ten pushed, and one of four here.
    assert cells[Approach.TRAJECTORY].inside
    assert not cells[Approach.GOAL_BASED].inside
    assert not any(cell.asks for cell in cells.values())
