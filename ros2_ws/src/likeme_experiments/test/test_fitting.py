"""The fit of the cell's parameters: test, split, deviance, trials and search."""

from __future__ import annotations

import json
from itertools import product
from math import factorial
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from likeme_arm_sim.fitted_parameters import fitted_parameters, fitted_values
from likeme_core.paper_world import WORLD
from likeme_experiments.commands.fit_physics import app, values_in
from likeme_experiments.physics_fit.deviance import MAX_DEVIANCE, deviance
from likeme_experiments.physics_fit.evaluate import RowEvaluation, evaluate_row, table_text
from likeme_experiments.physics_fit.level_trials import read, try_levels
from likeme_experiments.physics_fit.multinomial_test import multinomial_p_value, smoothed
from likeme_experiments.physics_fit.search import MARGIN, STEPS, best_level, levels, touches
from likeme_experiments.physics_fit.table_rows import split, table_rows

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


def test_invalid_distributions_are_rejected() -> None:
    with pytest.raises(ValueError, match=r'sum to 1, got 0\.900'):
        multinomial_p_value((1, 2, 3), np.array([0.3, 0.3, 0.3]))
    with pytest.raises(ValueError, match='Expected 3 counts'):
        multinomial_p_value((1, 2), np.array([0.5, 0.5]))


def test_the_rows_are_the_real_robots_and_split_in_half() -> None:
    table = table_rows()
    assert len(table) == 36
    assert {sum(row.real) for row in table} == {10}
    seen, held = split(table)
    assert len(seen) == len(held) == 18
    assert set(seen) | set(held) == set(table)
    assert not any(row.idle for row in seen)
    for name, manner in product(WORLD.objects, WORLD.manners):
        mine = [r for r in seen if r.name == name and r.action.manner is manner]
        assert len(mine) == 3


def test_deviance_is_small_where_counts_agree_or_trials_are_few() -> None:
    assert deviance((5, 5, 0), (6, 6, 0)) == 0.0
    assert 0.0 < deviance((5, 5, 0), (9, 3, 0)) < deviance((5, 5, 0), (12, 0, 0)) < MAX_DEVIANCE
    assert deviance((0, 10, 0), (1, 1, 0)) < deviance((0, 10, 0), (12, 12, 0))
    assert deviance((0, 10, 0), (50, 0, 0)) == MAX_DEVIANCE


@pytest.mark.parametrize(
    ('parameter', 'touched'),
    [
        ('pear_mass', {'pear PLACE_LEFT', 'pear PLACE_OFFTABLE'}),
        ('lemon_rolling', {'lemon PUSH_LEFT', 'lemon PUSH_OFFTABLE', 'lemon PLACE_LEFT'}),
        ('place_share', {'pear PLACE_LEFT', 'lemon PLACE_LEFT', 'chicken PLACE_LEFT'}),
        ('reach', {'pear PUSH_OFFTABLE', 'lemon PUSH_OFFTABLE'}),
        ('push_gap', {'chicken PUSH_LEFT', 'lemon PUSH_OFFTABLE'}),
        ('arm_noise', {'chicken PUSH_LEFT', 'pear PLACE_OFFTABLE'}),
    ],
)
def test_a_parameter_affects_its_rows(parameter: str, touched: set[str]) -> None:
    affected = {f'{r.name} {r.action.name}' for r in table_rows() if touches(parameter, r)}
    assert touched <= affected
    if parameter == 'pear_mass':
        assert all(pair.startswith('pear PLACE') for pair in affected)
    if parameter == 'reach':
        assert all(pair.endswith('PUSH_OFFTABLE') for pair in affected)


def test_every_searched_parameter_affects_fitted_rows() -> None:
    seen, _ = split(table_rows())
    for parameter, _ in STEPS:
        assert parameter in fitted_parameters(WORLD)
        assert any(touches(parameter, row) for row in seen)


@pytest.mark.parametrize('name', sorted({name for name, _ in STEPS}))
def test_levels_ascend_within_the_range_and_include_the_value(name: str) -> None:
    p = fitted_parameters(WORLD)[name]
    for value in (p.low, p.value, p.high):
        tried = levels(name, value)
        assert value in tried
        assert tried == sorted(set(tried))
        assert p.low <= tried[0] <= tried[-1] <= p.high


def test_values_to_evaluate_are_read_from_what_a_search_leaves(tmp_path: Path) -> None:
    path = tmp_path / 'parameters.json'
    path.write_text(json.dumps(fitted_values(WORLD)))
    assert values_in(path) == fitted_values(WORLD)
    path.write_text('{"reach": 0.6}')
    assert values_in(path) == {'reach': 0.6}


@pytest.mark.parametrize(
    ('text', 'sentence'),
    [
        ('{', 'Expected JSON'),
        ('[0.6]', 'Expected values by name'),
        ('{"Reach": 0.6}', "Expected one of pear_friction, .*, got 'Reach'"),
        ('{"reach": 6}', 'Expected 0.56 to 0.66 for reach, got 6'),
        ('{"reach": NaN}', 'Expected 0.56 to 0.66 for reach, got nan'),
        ('{"reach": true}', 'Expected 0.56 to 0.66 for reach, got True'),
    ],
)
def test_values_that_cannot_be_evaluated_are_refused(
    text: str, sentence: str, tmp_path: Path
) -> None:
    path = tmp_path / 'parameters.json'
    path.write_text(text)
    with pytest.raises(typer.BadParameter, match=sentence):
        values_in(path)
    out = tmp_path / 'out'
    answer = CliRunner().invoke(app, ['--parameters', str(path), '--out', str(out)])
    assert answer.exit_code == 2
    assert not out.exists()


def test_a_level_must_be_better_by_the_margin() -> None:
    row = next(r for r in table_rows() if str(r) == 'pear LEFT PUSH_RIGHT')
    assert row.real == (0, 10, 0)
    name = str(row)
    tried: dict[float, dict[str, tuple[int, int, int]]] = {
        0.1: {name: (0, 8, 0)},
        0.2: {name: (8, 0, 0)},
    }
    level, here, there = best_level(0.2, tried, [row])
    assert level == 0.1
    assert here == 0.0
    assert there > MARGIN
    alike: dict[float, dict[str, tuple[int, int, int]]] = {
        0.1: {name: (0, 80, 0)},
        0.2: {name: (1, 79, 0)},
    }
    assert best_level(0.2, alike, [row])[0] == 0.2


def test_trials_are_kept_and_continued(tmp_path: Path) -> None:
    path = tmp_path / 'trials.jsonl'
    seen = [r for r in table_rows() if str(r) == 'chicken LEFT PUSH_LEFT']
    wanted, progress = [0.0, 0.04], list[int]()
    made = try_levels(
        path, 0, 'push_gap', wanted, fitted_values(WORLD), seen, range(5, 6), 1, progress.append
    )
    assert [sum(made[level][str(seen[0])]) for level in wanted] == [1, 1]
    lines = read(path)
    torn = path.read_text().splitlines()[0] + '\n{"step": 0, "parameter": "push_g'
    path.write_text(torn)
    again = try_levels(
        path, 0, 'push_gap', wanted, fitted_values(WORLD), seen, range(5, 6), 1, progress.append
    )
    assert again == made
    assert sorted(read(path)) == sorted(lines)
    assert progress == [0, 1, 2, 1, 2]


def test_the_table_reports_passing_rows() -> None:
    table = table_rows()
    seen, _ = split(table)
    entries = [RowEvaluation(row, (5, 5, 0), 0.5 if row in seen else 0.01) for row in table]
    text = table_text(entries, seen)
    assert 'all 18 of 36; fitted 18 of 18; held out 0 of 6; held out, idle 0 of 12' in text


@pytest.mark.parametrize('name', SHIPPED_ROWS)
def test_the_shipped_parameters_give_recorded_rows(name: str) -> None:
    row = next(row for row in table_rows() if str(row) == name)
    entry = evaluate_row(fitted_values(WORLD), row, 16)
    assert entry.passes, entry
