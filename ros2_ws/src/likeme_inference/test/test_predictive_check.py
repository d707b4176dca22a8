"""Predictive checks: uniform p for what the model makes, small ones for what it cannot make."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy import stats

from likeme_inference.tabletop import (
    CONCENTRATION,
    exchangeable_check,
    halves,
    held_out_check,
    holm,
    posterior_check,
    shipped,
)
from likeme_inference.tabletop.arrays import FloatArray, IntArray

COUNTS = np.array([known.counts for known in shipped().objects.values()])
ROWS = 36
PRIOR = 0.5


def batches(rng: np.random.Generator, p: FloatArray, trials: int) -> IntArray:
    """Trials of rows, p of shape [batch, row, x_f]."""
    return rng.multinomial(trials, p)


def rows_of_the_prior(rng: np.random.Generator, rows: int = ROWS) -> FloatArray:
    return rng.dirichlet([PRIOR] * 3, size=rows)


def test_p_are_uniform_for_trials_that_the_model_makes() -> None:
    overall: dict[str, list[float]] = {'posterior': [], 'held out': [], 'order': []}
    small: dict[str, list[float]] = {name: [] for name in overall}
    for seed in range(100):
        rng = np.random.default_rng(seed)
        made = batches(rng, np.stack([rows_of_the_prior(rng)] * 3), 4)
        for name, check in (
            ('posterior', posterior_check(made, PRIOR, rng, 199)),
            ('held out', held_out_check(made, PRIOR, rng, 199)),
            ('order', exchangeable_check(made, rng, 199)),
        ):
            overall[name].append(check.overall())
            small[name].append(float((check.p() <= 0.05).mean()))
    for name in ('held out', 'order'):
        assert stats.kstest(overall[name], 'uniform').pvalue > 0.01, name
    # A row has few possible outcomes: its p keeps the level, and may be conservative.
    assert all(np.mean(shares) <= 0.055 for shares in small.values())
    # Trials that are used twice: nearer 1/2 than uniform numbers, whose deviation is 0.29.
    assert np.std(overall['posterior']) < 0.25


def test_drift_is_seen_in_batches_and_not_in_totals() -> None:
    rng = np.random.default_rng(1)
    start, end = rows_of_the_prior(rng), rows_of_the_prior(rng)
    share = np.linspace(0, 1, 4)[:, None, None]
    made = batches(rng, (1 - share) * start + share * end, 5)

    assert posterior_check(made, PRIOR, rng).overall() < 0.01
    assert held_out_check(made, PRIOR, rng).overall() < 0.001
    assert exchangeable_check(made, rng).overall() < 0.001
    assert posterior_check(made.sum(axis=0)[None], PRIOR, rng).overall() > 0.1


def test_batches_that_differ_more_than_chance_has_them() -> None:
    rng = np.random.default_rng(2)
    steady = rows_of_the_prior(rng)
    overdispersed = np.stack([[rng.dirichlet(2 * p + 0.01) for p in steady] for _ in range(5)])
    made = batches(rng, overdispersed, 6)
    assert held_out_check(made, PRIOR, rng).overall() < 0.001
    assert exchangeable_check(made, rng).overall() < 0.001


def test_the_row_that_changes_is_found_among_others() -> None:
    rng = np.random.default_rng(3)
    p = np.stack([rows_of_the_prior(rng)] * 2)
    p[0, 20], p[1, 20] = (0.95, 0.05, 0.0), (0.05, 0.05, 0.9)
    made = batches(rng, p, 20)
    for check in (held_out_check(made, PRIOR, rng), exchangeable_check(made, rng)):
        assert np.flatnonzero(holm(check.p()) < 0.05).tolist() == [20]


def test_a_prior_that_overrules_the_trials() -> None:
    rng = np.random.default_rng(4)
    reach = np.array([True, True, False])[:, None]
    assert posterior_check(COUNTS[None], CONCENTRATION, rng).overall(reach) > 0.3
    assert posterior_check(COUNTS[None], 10.0, rng).overall(reach) < 0.001
    halved = halves(COUNTS, rng)
    assert np.array_equal(halved.sum(axis=0), COUNTS)
    assert (halved.sum(axis=-1) == 5).all()
    assert held_out_check(halved, 10.0, rng).overall(reach) < 0.001


def test_held_out_p_is_that_of_the_enumeration() -> None:
    made = np.array([[[3, 1, 0]], [[0, 1, 1]], [[0, 0, 2]]])
    prior = np.array([0.3, 0.5, 0.7])
    two = [n for n in product(range(3), repeat=3) if sum(n) == 2]

    def p_of(second: tuple[int, ...], third: tuple[int, ...]) -> float:
        before = prior + made[0, 0]
        p = stats.dirichlet_multinomial.pmf(second, before, 2)
        return float(p * stats.dirichlet_multinomial.pmf(third, before + second, 2))

    p = [p_of(second, third) for second, third in product(two, two)]
    assert sum(p) == pytest.approx(1)
    exact = sum(q for q in p if q <= p_of((0, 1, 1), (0, 0, 2)) * (1 + 1e-9))
    check = held_out_check(made, prior, np.random.default_rng(5), 20_000)
    assert check.p()[0] == pytest.approx(exact, abs=4 * np.sqrt(exact / 20_000))


def test_order_p_is_that_of_the_enumeration() -> None:
    made = np.array([[[5, 1]], [[1, 5]]])
    counts = np.arange(7)
    p = stats.hypergeom.pmf(counts, 12, 6, 6)
    # With equal margins the discrepancy grows with the distance from 3.
    exact = p[abs(counts - 3) >= 2].sum()
    check = exchangeable_check(made, np.random.default_rng(6), 20_000)
    assert check.p()[0] == pytest.approx(exact, abs=4 * np.sqrt(exact / 20_000))


def test_rows_that_are_not_predicted_are_left_out() -> None:
    rng = np.random.default_rng(7)
    made = np.array([[[3, 1], [0, 0], [4, 0]], [[2, 2], [0, 0], [0, 0]]])
    for check, tested in (
        (posterior_check(made, 1.0, rng, 50), [True, False, True]),
        (held_out_check(made, 1.0, rng, 50), [True, False, False]),
        (held_out_check(made, 1.0, rng, 50, learned_from=0), [True, False, True]),
        (exchangeable_check(made, rng, 50), [True, False, False]),
    ):
        assert np.isfinite(check.p()).tolist() == tested
        assert np.isnan(check.overall([False, True, False]))
        assert 0 < check.overall() <= 1


def test_in_parts_it_is_the_same_check(monkeypatch: pytest.MonkeyPatch) -> None:
    made = halves(COUNTS, np.random.default_rng(8))
    whole = held_out_check(made, 0.09, np.random.default_rng(9), 1000).overall()
    monkeypatch.setattr('likeme_inference.tabletop.predictive_check.PART', 50_000)
    parts = held_out_check(made, 0.09, np.random.default_rng(9), 1000)
    assert parts.replicated.shape == (1000, 3, 3, 6)
    assert parts.overall() == pytest.approx(whole, abs=0.08)
    twice = posterior_check(made, 0.09, np.random.default_rng(9), 1000)
    assert twice.observed.shape == twice.replicated.shape == (1000, 3, 3, 6)


def test_holm() -> None:
    assert holm([0.01, 0.04, np.nan, 0.03]) == pytest.approx(
        [0.03, 0.06, np.nan, 0.06], nan_ok=True
    )
    assert holm([[0.5, 0.9]]).tolist() == [[1.0, 1.0]]


@pytest.mark.parametrize(
    ('made', 'prior', 'said'),
    [
        (np.zeros((2, 3)), 1.0, 'Expected whole counts'),
        (np.array([3, 1]), 1.0, 'Expected whole counts'),
        (np.array([[-1, 1]]), 1.0, 'Expected counts of 0 or more'),
        (np.array([[1, 1]]), 0.0, 'Expected pseudo-counts above 0, got 0'),
    ],
)
def test_refusals(made: IntArray, prior: float, said: str) -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match=said):
        posterior_check(made, prior, rng, 10)
    with pytest.raises(ValueError, match=said):
        held_out_check(made, prior, rng, 10, learned_from=0)


def test_a_batch_must_be_left_to_predict() -> None:
    with pytest.raises(ValueError, match='Expected 0 to 0 batches, got 1'):
        held_out_check(COUNTS[None], 1.0, np.random.default_rng(0))
