"""Draws of the posterior: closed-form moments, the .npz file, ArviZ."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from likeme_inference.tabletop import (
    CONCENTRATION,
    Domain,
    GoalModel,
    Policy,
    PosteriorDraws,
    Prior,
    RobotModel,
    TrialCounts,
    load_draws,
    posterior_draws,
    save_draws,
    shipped,
    to_arviz,
)

MODEL = shipped()
COUNTS = np.array([known.counts for known in MODEL.objects.values()])


@pytest.fixture(scope='module')
def draws() -> PosteriorDraws:
    return posterior_draws(MODEL, np.random.default_rng(0))


@pytest.fixture(scope='module')
def path(draws: PosteriorDraws, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp('draws') / 'of.any.name'
    save_draws(draws, path)
    return path


@pytest.fixture(scope='module')
def read(path: Path) -> dict[str, Any]:
    with np.load(path, allow_pickle=False) as file:
        return dict(file)


@pytest.mark.parametrize('which', ['posterior', 'prior'])
def test_the_file_has_the_moments_of_the_closed_form(read: dict[str, Any], which: str) -> None:
    alpha = CONCENTRATION + COUNTS * (which == 'posterior')
    total = alpha.sum(axis=-1, keepdims=True)
    mean, trials = alpha / total, COUNTS.sum(axis=-1, keepdims=True)
    variance = mean * (1 - mean) / (total + 1)

    drawn, again = read[f'{which}_transition'], read[f'{which}_counts']
    assert drawn.shape == (4, 1000, 3, 3, 6, 3)
    assert drawn.sum(axis=-1) == pytest.approx(1)
    # Four thousand draws: five standard errors of the mean; the variance within a fifth.
    assert (abs(drawn.mean(axis=(0, 1)) - mean) <= 5 * np.sqrt(variance / 4000)).all()
    assert drawn.var(axis=(0, 1)).sum() == pytest.approx(variance.sum(), rel=0.05)
    # The counts made again are Dirichlet multinomial.
    spread = trials * mean * (1 - mean) * (trials + total) / (1 + total)
    assert (again.sum(axis=-1) == trials[..., 0]).all()
    assert (abs(again.mean(axis=(0, 1)) - trials * mean) <= 5 * np.sqrt(spread / 4000)).all()
    assert again.var(axis=(0, 1)).sum() == pytest.approx(spread.sum(), rel=0.05)


def test_what_the_file_names(draws: PosteriorDraws, path: Path, read: dict[str, Any]) -> None:
    same = load_draws(path)

    assert read['objects'].tolist() == ['pear', 'lemon', 'chicken']
    assert read['actions'].tolist() == list(MODEL.domain.actions)
    assert np.array_equal(read['observed'], COUNTS)
    assert read['pseudo_counts'] == pytest.approx(CONCENTRATION)
    assert read['format'] == 1
    assert (same.model, same.states, same.policy) == (draws.model, draws.states, Policy.DIRECT)
    assert all(
        np.array_equal(mine, theirs)
        for mine, theirs in zip(
            (*same.posterior, *same.prior), (*draws.posterior, *draws.prior), strict=True
        )
    )


def test_another_file_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / 'other.npz', format=1, x=np.arange(3))
    with pytest.raises(ValueError, match='Expected posterior draws, got another file'):
        load_draws(tmp_path / 'other.npz')
    np.savez(tmp_path / 'newer.npz', format=2)
    with pytest.raises(ValueError, match='Expected format 1, got 2'):
        load_draws(tmp_path / 'newer.npz')
    np.save(tmp_path / 'one.npy', np.arange(3))
    for name, contents in (('text', b'no archive'), ('empty', b''), ('cut', b'PK\x03\x04')):
        (tmp_path / name).write_bytes(contents)
    for name in ('one.npy', 'text', 'empty', 'cut'):
        with pytest.raises(ValueError, match='got another file'):
            load_draws(tmp_path / name)
    with pytest.raises(OSError, match='gone'):
        load_draws(tmp_path / 'gone')


@pytest.mark.parametrize('policy', Policy)
def test_goals_are_those_of_the_goal_model_of_each_draw(policy: Policy) -> None:
    beliefs = (0.5, 0.3, 0.2)
    few = posterior_draws(MODEL, np.random.default_rng(1), 3, 2, goal_prior=beliefs, policy=policy)
    for chain, draw in ((0, 0), (1, 2)):
        model = GoalModel.of(
            few.posterior.transition[chain, draw, 1], MODEL.domain, beliefs, policy=policy
        )
        for x_i in range(3):
            for x_f in range(3):
                expected = model.goal_posterior(x_i, x_f)
                made = few.posterior.goal_probability[chain, draw, 1, x_i, x_f]
                assert made == pytest.approx(expected, abs=1e-12)
                told = few.demonstration('lemon', x_i, x_f)[chain, draw]
                assert told == pytest.approx(expected, abs=1e-12)
        unsure = model.goal_posterior([0.9, 0.1, 0.0], 1)
        told = few.demonstration('lemon', [0.9, 0.1, 0.0], 1)[chain, draw]
        assert told == pytest.approx(unsure, abs=1e-12)


def test_a_fitted_prior_and_another_domain() -> None:
    fitted = posterior_draws(MODEL, np.random.default_rng(2), 2, 1, prior=Prior.STRUCTURED)
    assert fitted.pseudo_counts[0] == pytest.approx(
        MODEL.counted('pear', prior=Prior.STRUCTURED).prior
    )
    kitchen = Domain(
        ('pan', 'plate', 'floor'), ('tip',), {'kept': ('pan', 'plate'), 'ate': ('plate',)}
    )
    rows = (TrialCounts('egg', 0, 0, (1, 7, 2), 'a'),)
    egg = posterior_draws(
        RobotModel('cook', '1', {'a': ''}, rows, kitchen), np.random.default_rng(3), 5, 1
    )
    assert egg.goals == ('kept', 'ate')
    assert egg.posterior.goal_probability.shape == (1, 5, 1, 3, 3, 2)
    assert (egg.posterior.counts[..., 1:, :, :] == 0).all()


def test_refusals(draws: PosteriorDraws) -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match='maximum likelihood has no posterior'):
        posterior_draws(MODEL, rng, concentration=0.0)
    with pytest.raises(ValueError, match='got 3, 0, 4'):
        posterior_draws(MODEL, rng, 0)
    with pytest.raises(ValueError, match='Expected 3 probabilities'):
        posterior_draws(MODEL, rng, goal_prior=[0.5, 0.5])
    with pytest.raises(ValueError, match="'banana'"):
        draws.demonstration('banana', 0, 1)
    with pytest.raises(ValueError, match='Expected one demonstration'):
        draws.demonstration('pear', [0, 1], 1)


def test_arviz_has_groups_with_named_dimensions(tmp_path: Path) -> None:
    arviz = pytest.importorskip('arviz', reason='ArviZ is not installed (test.sh --extras)')
    few = posterior_draws(MODEL, np.random.default_rng(4), 50, 2)
    made = to_arviz(few)

    for group in ('posterior', 'prior'):
        assert set(made[group].data_vars) == {'transition', 'goal_probability'}
    for group in ('posterior_predictive', 'prior_predictive', 'observed_data'):
        assert set(made[group].data_vars) == {'counts'}
    transition = made['posterior']['transition']
    assert transition.dims == ('chain', 'draw', 'object', 'x_i', 'action', 'x_f')
    at = {'object': 'lemon', 'x_i': 'RIGHT', 'action': 'PUSH_LEFT', 'x_f': 'LEFT'}
    assert np.array_equal(transition.sel(at).values, few.posterior.transition[:, :, 1, 1, 3, 0])
    belief = made['posterior']['goal_probability'].sel(object='pear', x_i='LEFT', x_f='RIGHT')
    assert belief.dims == ('chain', 'draw', 'goal')
    assert np.array_equal(belief.values, few.demonstration('pear', 0, 1))
    assert made['observed_data']['counts'].sel(at) == 6
    assert made['prior_predictive']['counts'].sizes['draw'] == 50
    assert float(made['constant_data']['pseudo_counts'].max()) == pytest.approx(CONCENTRATION)
    told = arviz.summary(made, var_names=['transition'])
    assert len(told) == 3 * 3 * 6 * 3
    made.to_netcdf(tmp_path / 'draws.nc')
    assert (tmp_path / 'draws.nc').stat().st_size > 0


def test_one_sentence_without_arviz(
    draws: PosteriorDraws, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, 'arviz', None)
    with pytest.raises(ImportError, match=r'Expected the Python package arviz .*, got none\.$'):
        to_arviz(draws)
