"""The search for the cell's parameters: its test, its split, its trials, its model."""

from __future__ import annotations

from itertools import product
from math import factorial
from pathlib import Path

import numpy as np
import pytest

from likeme_arm_sim.fitted import FITTED, values
from likeme_arm_sim.scene import OBJECTS, Action, State
from likeme_bringup.fitting.exact_test import deviance, multinomial_p_value, smoothed
from likeme_bringup.fitting.judge import Judged, judge_row, table_text
from likeme_bringup.fitting.rows import Row, rows, split
from likeme_bringup.fitting.surrogate import NAMES, best_values, learn, relevant, unit
from likeme_bringup.fitting.trials import Draw, drawn_values, one_draw, read, run_round

# One of each object and manner; what the real robot did in each is in the shipped model file.
SHIPPED_ROWS = (
    'pear LEFT PLACE_OFFTABLE',
    'pear RIGHT PUSH_OFFTABLE',
    'lemon RIGHT PLACE_OFFTABLE',
    'chicken RIGHT PLACE_LEFT',
    'chicken RIGHT PUSH_LEFT',
)


def enumerated(observed: tuple[int, int, int], p: tuple[float, float, float]) -> float:
    """The exact test again, by plain enumeration."""
    n, total = sum(observed), 0.0

    def pmf(counts: tuple[int, ...]) -> float:
        ways = factorial(n)
        for count in counts:
            ways //= factorial(count)
        return ways * float(np.prod([q**c for q, c in zip(p, counts, strict=True)]))

    for left, right in product(range(n + 1), repeat=2):
        if left + right <= n and pmf((left, right, n - left - right)) <= pmf(observed) * 1.000001:
            total += pmf((left, right, n - left - right))
    return total


@pytest.mark.parametrize('observed', [(8, 1, 1), (0, 10, 0), (3, 7, 0), (2, 2, 6)])
@pytest.mark.parametrize('p', [(0.8, 0.1, 0.1), (0.2, 0.5, 0.3), (0.98, 0.01, 0.01)])
def test_the_exact_test_is_exact(
    observed: tuple[int, int, int], p: tuple[float, float, float]
) -> None:
    assert multinomial_p_value(observed, np.array(p)) == pytest.approx(enumerated(observed, p))


def test_impossible_results_fail_and_certain_ones_pass() -> None:
    assert multinomial_p_value((9, 1, 0), np.array([1.0, 0.0, 0.0])) == 0.0
    assert multinomial_p_value((10, 0, 0), np.array([1.0, 0.0, 0.0])) == 1.0
    assert multinomial_p_value((10, 0, 0), smoothed((25, 25, 0))) < 0.05


def test_what_is_no_distribution_is_refused() -> None:
    with pytest.raises(ValueError, match=r'sum to 1, got 0\.900'):
        multinomial_p_value((1, 2, 3), np.array([0.3, 0.3, 0.3]))
    with pytest.raises(ValueError, match='Expected 3 counts'):
        multinomial_p_value((1, 2), np.array([0.5, 0.5]))


def test_deviance_is_zero_where_it_fits() -> None:
    assert deviance((2, 3, 5), np.array([0.2, 0.3, 0.5])) == pytest.approx(0.0)
    assert deviance((10, 0, 0), np.array([0.5, 0.3, 0.2])) == pytest.approx(20 * np.log(2))


def test_the_rows_are_the_real_robots_and_split_in_half() -> None:
    table = rows()
    assert len(table) == 36
    assert {sum(row.real) for row in table} == {10}
    seen, held = split(table)
    assert len(seen) == len(held) == 18
    assert set(seen) | set(held) == set(table)
    assert not any(row.idle for row in seen)
    for name, is_push in product(OBJECTS, (False, True)):
        mine = [r for r in seen if r.name == name and r.action.is_push is is_push]
        assert len(mine) == 3


def test_parameters_are_drawn_in_their_ranges() -> None:
    rng, centre = np.random.default_rng(1), {name: p.high for name, p in FITTED.items()}
    for _ in range(50):
        drawn = drawn_values(centre, 0.5, rng)
        for name, p in FITTED.items():
            assert (p.low + p.high) / 2 - 1e-9 <= drawn[name] <= p.high + 1e-9


def known_world(row: Row, count: int) -> list[Draw]:
    """Draws whose trials of a pear's PLACE_RIGHT succeed the surer the stronger the grip."""
    rng, centre, draws = np.random.default_rng(2), values(), []
    for index in range(count):
        drawn = drawn_values(centre, 1.0, rng)
        strength = unit(drawn)[NAMES.index('grip_force')]
        end = State.RIGHT if rng.uniform() < 1 / (1 + np.exp(-4 * strength)) else State.LEFT
        draws.append(Draw(0, index, drawn, {str(row): int(end)}))
    return draws


def test_the_model_finds_what_matters() -> None:
    row = Row('pear', State.LEFT, Action.PLACE_RIGHT, (9, 1, 0))
    draws = known_world(row, 300)
    middle = unit({name: (p.low + p.high) / 2 for name, p in FITTED.items()})
    weak, strong = middle.copy(), middle.copy()
    grip = NAMES.index('grip_force')
    weak[grip], strong[grip] = -0.8, 0.8
    p = learn(row, [row], draws, middle).probabilities(np.array([weak, strong]))
    assert p[0, 0] > 0.7
    assert p[1, 1] > 0.7
    found, loss = best_values([row], draws, values(), seed=1)
    assert unit(found)[grip] < -0.2
    assert loss < 0.3


def test_only_what_can_matter_is_asked() -> None:
    place = Row('pear', State.LEFT, Action.PLACE_RIGHT, (8, 1, 1))
    names = {NAMES[i] for i in relevant(place)}
    assert {'pear_friction', 'grip_force'} <= names
    assert not names & {'lemon_friction', 'push_gap'}


def test_trials_are_kept_and_gone_on_with(tmp_path: Path) -> None:
    path, tried = (
        tmp_path / 'trials.jsonl',
        [r for r in rows() if str(r) == 'chicken LEFT PUSH_LEFT'],
    )
    alone = [one_draw(3, 0, index, values(), 1.0, tried) for index in range(2)]
    told: list[int] = []
    run_round(path, 3, 0, 2, values(), 1.0, tried, 1, told.append)
    assert read(path) == alone
    torn = path.read_text().splitlines()[0] + '\n{"round": 0, "index": 1, "val'
    path.write_text(torn)
    run_round(path, 3, 0, 2, values(), 1.0, tried, 1, told.append)
    assert read(path) == alone
    assert told == [0, 1, 2, 1, 2]


def test_the_table_says_what_passes() -> None:
    table = rows()
    seen, _ = split(table)
    entries = [Judged(row, (5, 5, 0), 0.5 if row in seen else 0.01) for row in table]
    text = table_text(entries, seen)
    assert 'all 18 of 36; fitted 18 of 18; held out 0 of 6; held out, idle 0 of 12' in text


@pytest.mark.parametrize('name', SHIPPED_ROWS)
def test_the_shipped_parameters_give_recorded_rows(name: str) -> None:
    row = next(row for row in rows() if str(row) == name)
    entry = judge_row(values(), row, 16)
    assert entry.passes, entry
