"""The Dirichlet posterior: its bounds, its default, and draws from it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from likeme_core.paper_world import LEFT, PLACE_LEFT, PUSH_LEFT, RIGHT, WORLD
from likeme_inference.tabletop import dirichlet
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.dirichlet import (
    CONCENTRATION,
    aimed_prior,
    credible_interval,
    leave_one_out,
    sample_transitions,
)
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.transition_model import TransitionModel

PEAR = shipped().objects['pear']
AIMS = tuple(action.target for action in WORLD.actions)


def held_out(prior: float | FloatArray) -> float:
    """Leave-one-out likelihood of the real trials from LEFT and RIGHT."""
    prior = np.broadcast_to(prior, (3, 6, 3))
    models = shipped().objects.values()
    # Rows of OFFTABLE say nothing: their trials are taken out.
    reach = np.array([1, 1, 0])[:, None, None]
    return sum(leave_one_out(TransitionModel(m.counts * reach, prior)) for m in models)


def test_the_default_is_the_best_on_the_real_trials() -> None:
    assert held_out(CONCENTRATION) == pytest.approx(-188.99, abs=0.01)
    for other in (0.01, 0.03, 0.2, 0.5, 1.0):
        assert held_out(other) < held_out(CONCENTRATION) - 1
    assert held_out(aimed_prior(3, AIMS)) == pytest.approx(-184.75, abs=0.01)
    assert held_out(0.0) == -np.inf


@pytest.mark.parametrize('factor', [0.7, 1.4])
@pytest.mark.parametrize('name', ['stay', 'aimed', 'elsewhere'])
def test_the_aimed_prior_is_the_best_of_its_family(name: str, factor: float) -> None:
    usual = {'stay': dirichlet.STAY, 'aimed': dirichlet.AIMED, 'elsewhere': dirichlet.ELSEWHERE}
    other = usual | {name: usual[name] * factor}

    assert held_out(aimed_prior(3, AIMS, **other)) < held_out(aimed_prior(3, AIMS))


def test_axes_of_the_aimed_prior() -> None:
    prior = aimed_prior(3, AIMS)

    assert prior[RIGHT, PUSH_LEFT].tolist() == [
        dirichlet.AIMED, dirichlet.STAY, dirichlet.ELSEWHERE,
    ]  # fmt: skip
    assert prior[LEFT, PLACE_LEFT].tolist() == [
        dirichlet.STAY, dirichlet.ELSEWHERE, dirichlet.ELSEWHERE,
    ]  # fmt: skip


@pytest.mark.parametrize('prior', [CONCENTRATION, 1.0])
def test_bounds_are_those_of_the_beta_distribution(prior: float) -> None:
    model = TransitionModel(PEAR.counts, prior)
    low, high = credible_interval(model, 0.9)

    mine = model.pseudo_counts[RIGHT, PUSH_LEFT]
    beta = stats.beta(mine[0], mine[1:].sum())
    assert low[RIGHT, PUSH_LEFT, 0] == pytest.approx(beta.ppf(0.05))
    assert high[RIGHT, PUSH_LEFT, 0] == pytest.approx(beta.ppf(0.95))
    assert np.all((low <= model.transition) & (model.transition <= high))


def test_bounds_without_a_prior_use_the_default_and_narrow_with_trials() -> None:
    assert np.array_equal(
        credible_interval(PEAR).high,
        credible_interval(TransitionModel(PEAR.counts, CONCENTRATION)).high,
    )
    few, many = credible_interval(PEAR), credible_interval(TransitionModel(PEAR.counts * 100))
    assert np.all(many.high - many.low <= few.high - few.low)
    with pytest.raises(ValueError, match='between 0 and 1, got 1'):
        credible_interval(PEAR, 1.0)


def test_interval_of_states_excluded_by_the_prior() -> None:
    prior = np.broadcast_to([1.0, 1.0, 0.0], (3, 6, 3))
    low, high = credible_interval(TransitionModel.untried(3, 6, prior))

    assert (low[0, 0, 2], high[0, 0, 2]) == (0, 0)
    alone = np.broadcast_to([1.0, 0.0, 0.0], (3, 6, 3))
    assert credible_interval(TransitionModel.untried(3, 6, alone)).low[0, 0].tolist() == [1, 0, 0]


def test_interval_of_a_row_without_trials_and_prior() -> None:
    prior = np.zeros((3, 6, 3))
    prior[0] = 0.5
    low, high = credible_interval(TransitionModel.untried(3, 6, prior))

    assert low[1, 0] == pytest.approx(stats.beta(1, 2).ppf(0.025))
    assert high[1, 0] == pytest.approx(stats.beta(1, 2).ppf(0.975))


def test_leave_one_out_of_a_single_trial() -> None:
    assert leave_one_out(TransitionModel.untried(2, 1).add(0, 0, 1)) == -np.inf


def test_samples_have_the_posterior_mean() -> None:
    model = TransitionModel(PEAR.counts, CONCENTRATION)
    drawn = sample_transitions(model, np.random.default_rng(1), 4000)

    assert drawn.sum(axis=-1) == pytest.approx(np.ones((4000, 3, 6)))
    assert drawn.mean(axis=0) == pytest.approx(model.transition, abs=0.01)


def test_samples_of_rows_with_tiny_pseudo_counts() -> None:
    tiny = sample_transitions(TransitionModel.untried(3, 6, 1e-9), np.random.default_rng(1), 100)
    none = sample_transitions(TransitionModel.untried(3, 6), np.random.default_rng(1), 4000)

    assert (tiny.max(axis=-1) == 1).all()
    assert tiny.mean(axis=0) == pytest.approx(np.full((3, 6, 3), 1 / 3), abs=0.2)
    assert none.mean(axis=0) == pytest.approx(np.full((3, 6, 3), 1 / 3), abs=0.02)
