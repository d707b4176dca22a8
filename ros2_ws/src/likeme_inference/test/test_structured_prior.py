"""What one object borrows from others: the latent posterior, the kernel, and the prior."""

from __future__ import annotations

import re

import numpy as np
import pytest

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.tabletop import Manner
from likeme_core.world import load_world
from likeme_inference.tabletop import TABLETOP, Domain, Prior, help_rate, shipped
from likeme_inference.tabletop.imitation import ImitationSettings, decide
from likeme_inference.tabletop.laplace import laplace
from likeme_inference.tabletop.latent_kernel import (
    COMPONENTS,
    manner_of,
    mirrors,
    row_kernel,
)
from likeme_inference.tabletop.population_prior import (
    START,
    fit_population,
    population_prior,
)
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.shared_prior import fit_weights, shared_prior
from likeme_inference.tabletop.structure_fit import Structure, fit_structure
from likeme_inference.tabletop.structured_prior import StructuredPrior, _success
from likeme_inference.tabletop.values import Decision
from likeme_inference.value_json import from_json, to_json

COUNTS = np.array([known.counts for known in shipped().objects.values()], dtype=float)
THREE = shipped(load_world('three_bins'))
WORLD = load_world()
LEFT, RIGHT, OFFTABLE = WORLD.states
PUSH_LEFT, PUSH_RIGHT = 3, 4


def test_laplace_agrees_with_integration_over_one_row() -> None:
    kernel, successes, trials = np.array([[1.5]]), np.array([7.0]), np.array([10.0])
    found = laplace(kernel, successes, trials)
    z = np.linspace(-8, 8, 4001)
    log_p = -7 * np.log1p(np.exp(-z)) - 3 * np.log1p(np.exp(z)) - z**2 / 3
    density = np.exp(log_p)
    evidence = np.log(density.sum() * (z[1] - z[0]) / np.sqrt(3 * np.pi))
    assert found.mode[0] == pytest.approx(z[log_p.argmax()], abs=0.005)
    assert found.evidence == pytest.approx(evidence, abs=0.02)
    variance = (kernel - kernel @ found.precision @ kernel)[0, 0]
    mean = (density * z).sum() / density.sum()
    assert variance == pytest.approx((density * (z - mean) ** 2).sum() / density.sum(), rel=0.1)


def test_weights_are_the_gradient_at_the_mode() -> None:
    rng = np.random.default_rng(0)
    root = rng.normal(size=(6, 6))
    trials = rng.integers(0, 9, 6).astype(float)
    successes = rng.binomial(trials.astype(int), 0.6).astype(float)
    found = laplace(root @ root.T, successes, trials)
    p = 1 / (1 + np.exp(-found.mode))
    assert found.weights == pytest.approx(successes - trials * p, abs=1e-3)
    assert root @ root.T @ found.weights == pytest.approx(found.mode)


def test_what_is_predicted_of_a_row_does_not_depend_on_its_own_trials() -> None:
    """Two rows of common log odds: one is predicted from the other alone, by integration."""
    kernel = np.full((2, 2), 1.0) + 0.3 * np.eye(2)
    for own in (0.0, 4.0):
        found = laplace(kernel, np.array([own, 6.0]), np.array([own, 8.0]))
        mean, square = (each[0] for each in _success(found, kernel))
        one, other = np.meshgrid(np.linspace(-7, 7, 701), np.linspace(-7, 7, 701), indexing='ij')
        inverse = np.linalg.inv(kernel)
        prior = inverse[0, 0] * (one**2 + other**2) / 2 + inverse[0, 1] * one * other
        density = np.exp(-6 * np.log1p(np.exp(-other)) - 2 * np.log1p(np.exp(other)) - prior)
        p = 1 / (1 + np.exp(-one))
        assert mean == pytest.approx((density * p).sum() / density.sum(), abs=0.02)
        assert square == pytest.approx((density * p**2).sum() / density.sum(), abs=0.02)


def test_components_of_the_papers_table() -> None:
    rows = row_kernel(TABLETOP, mirror=(1, 0, 2))
    alike = dict(zip(COMPONENTS, rows.components, strict=True))
    assert len(rows.pairs) == 8
    # From LEFT and from RIGHT, the same is true of PUSH across: direction and mirror agree here.
    pairs = rows.pairs.tolist()
    across, back = pairs.index([LEFT, PUSH_RIGHT]), pairs.index([RIGHT, PUSH_LEFT])
    assert alike['manner'][across, back] == 1
    assert alike['pair'][across, back] == 0
    assert alike['manner'].sum() == 4 * 2**2
    assert not alike['mirror'].any()
    reached, trials = rows.succeeded(rows.trials(COUNTS))
    pear = list(shipped().objects).index('pear')
    assert (reached[pear, back], trials[pear, back]) == (4, 10)


def test_the_population_is_pooled_where_objects_do_not_differ() -> None:
    """Limits: objects alike are pooled; objects that all differ are worth one each."""
    rows = row_kernel(TABLETOP)
    trials = np.zeros((4, 8, 3))
    at = np.arange(8)
    trials[:3, at, rows.aims] = 30
    trials[:3, at, rows.pairs[:, 0]] = 10
    alike, differing = (
        population_prior(rows, trials, START._replace(concentration=c)) for c in (1e9, 1e-9)
    )
    by_role = 2.1
    assert alike[3].sum(axis=-1) == pytest.approx(120 + by_role)
    assert alike[3, at, rows.aims] == pytest.approx(90 + 1)
    share = differing[3] / differing[3].sum(axis=-1, keepdims=True)
    assert share[at, rows.aims] == pytest.approx((3 * 0.75 + 1) / (3 + by_role))
    # The prior of an object is from the others' trials; without any, it is that of the roles.
    assert alike[0].sum(axis=-1) == pytest.approx(80 + by_role)
    none = population_prior(rows, np.zeros((1, 8, 3)), START)
    assert none[0, at, rows.aims] == pytest.approx(none[0, at, rows.pairs[:, 0]])
    assert (none > 0).all()


def test_the_population_is_fitted_to_how_much_objects_differ() -> None:
    rng, rows = np.random.default_rng(0), row_kernel(THREE.domain)
    mean = rng.dirichlet(np.ones(4), len(rows.pairs))
    fitted = []
    for c in (2.0, 50.0):
        world = np.array([[rng.dirichlet(c * m + 1e-9) for m in mean] for _ in range(8)])
        fitted.append(fit_population(rows, rng.multinomial(20, world).astype(float)).concentration)
    assert fitted[0] < 4 < 15 < fitted[1]


def test_mirrors_and_manners_come_from_the_domain() -> None:
    assert list(mirrors(TABLETOP)) == [(1, 0, 2)]
    swaps = list(mirrors(THREE.domain))
    assert len(swaps) == 3
    assert (2, 1, 0, 3) in swaps
    assert manner_of(TABLETOP, PUSH_LEFT) == 'PUSH'
    odd = Domain(('a', 'b'), ('swing',), aims={'swing': 'b'})
    assert manner_of(odd, 0) == 'swing'
    many = tuple(f's{i}' for i in range(8))
    assert not list(mirrors(Domain(many, ('go',), aims={'go': 's0'})))
    with pytest.raises(ValueError, match='Expected every action aimed at a state'):
        row_kernel(Domain(('a', 'b'), ('swing',)))


@pytest.mark.parametrize('o', range(3))
def test_an_object_left_out_is_predicted_better_than_by_pooling(o: int) -> None:
    others = COUNTS.copy()
    others[o] = 0
    prior = StructuredPrior.of(others, TABLETOP).pseudo_counts[o]
    assert prior.shape == (3, 6, 3)
    pooled = others.sum(axis=0) + 0.09
    ours, theirs = (
        -(COUNTS[o] * np.log(p / p.sum(axis=-1, keepdims=True)))[:2].sum() for p in (prior, pooled)
    )
    assert ours < theirs


def test_without_trials_nothing_is_borrowed_and_every_row_has_a_prior() -> None:
    prior = StructuredPrior.of(np.zeros((2, 3, 6, 3)), TABLETOP)
    assert prior.structure == Structure()
    assert (prior.pseudo_counts > 0).all()
    assert prior.borrowed(0, LEFT, PUSH_RIGHT).tolist() == [0, 0]
    assert prior.similarity == pytest.approx(np.eye(2))


def test_objects_that_behave_alike_are_similar_and_lend_more() -> None:
    """Two objects that no action moves, two that every action moves, and one like the former."""
    aims = TABLETOP.state_aims
    counts = np.zeros((5, 3, 6, 3))
    for x in (LEFT, RIGHT):
        for a, aim in enumerate(aims):
            counts[[0, 1], x, a, x] = 10
            counts[[2, 3], x, a, aim] = 10
    counts[4, LEFT, PUSH_RIGHT, LEFT] = 6
    prior = StructuredPrior(counts, TABLETOP, Structure(own=(1.0, 0.0, 1.0, 1.0, 1.0)))
    similar = prior.similarity
    assert similar[0, 1] > 0.3 > similar[0, 2]
    assert similar[4, 0] > similar[4, 2]
    assert (np.linalg.eigvalsh(similar) > -1e-9).all()
    # It never tried the way back, but stays there too, most likely.
    row = prior.pseudo_counts[4, RIGHT, PUSH_LEFT]
    assert row[RIGHT] > 1.2 * row[LEFT]
    lent = prior.borrowed(4, RIGHT, PUSH_LEFT)
    assert lent[0] + lent[1] > lent[2] + lent[3]
    assert lent.sum() == pytest.approx(row.sum())


def test_rows_in_which_nothing_is_to_be_moved_have_the_shared_prior() -> None:
    aims = TABLETOP.state_aims
    shared = shared_prior(COUNTS, fit_weights(COUNTS, aims, rounds=3), aims)
    prior = StructuredPrior(COUNTS, TABLETOP, Structure()).pseudo_counts
    assert prior[:, OFFTABLE] == pytest.approx(shared[:, OFFTABLE])
    assert prior[:, LEFT, PUSH_LEFT] == pytest.approx(shared[:, LEFT, PUSH_LEFT])
    assert not np.allclose(prior[:, LEFT, PUSH_RIGHT], shared[:, LEFT, PUSH_RIGHT])


def test_a_world_of_other_regions_and_an_order_of_objects_that_does_not_matter() -> None:
    counts = np.array([known.counts for known in THREE.objects.values()], dtype=float)[:2]
    one = StructuredPrior(counts, THREE.domain, Structure()).pseudo_counts
    other = StructuredPrior(counts[::-1], THREE.domain, Structure()).pseudo_counts
    assert one.shape == (2, 4, 8, 4)
    assert one == pytest.approx(other[::-1], rel=1e-6)


def test_a_fitted_structure_explains_the_trials_better() -> None:
    fitted = fit_structure(COUNTS, TABLETOP)
    alone = np.zeros((1, *COUNTS.shape[1:]))
    assert fit_structure(np.concatenate([COUNTS, alone]), TABLETOP) == fitted
    evidence = [
        StructuredPrior(COUNTS, TABLETOP, structure)._alone.evidence
        for structure in (Structure(), fitted)
    ]
    assert evidence[1] > evidence[0]


def _decided(model: RobotModel, prior: Prior) -> Decision:
    demo = Demonstration(0, '', 'pear', RIGHT, LEFT, Manner.PLACE, 0, 0)
    view = TableSnapshot(1, '', True, {'pear': RIGHT})
    return decide(model, ImitationSettings(prior=prior), demo, view, 1)


@pytest.mark.parametrize('prior', [Prior.SHARED, Prior.STRUCTURED])
def test_a_decision_says_what_its_own_trials_and_borrowed_ones_are(prior: Prior) -> None:
    tried, never = (
        _decided(shipped(), prior),
        _decided(shipped().only(['lemon', 'chicken']), prior),
    )
    assert tried.support is not None
    assert never.support is not None
    assert (tried.support.trials, tried.support.object_trials) == (10, 180)
    assert (never.support.trials, never.support.object_trials) == (0, 0)
    for decision in (tried, never):
        support = decision.support
        assert support is not None
        assert support.low < decision.predicted_success < support.high
    assert never.support.high - never.support.low > tried.support.high - tried.support.low
    expected = (
        rf'I never tried the pear; from (lemon and chicken|chicken and lemon) I expect '
        rf'{never.predicted_success:.2f} '
        rf'\({never.support.low:.2f} to {never.support.high:.2f}\)\.$'
    )
    assert re.search(expected, never.sentence)
    assert 'I tried that 10 times with the pear, and borrow what is worth' in tried.sentence
    assert from_json(Decision, to_json(never), WORLD) == never


def test_a_decision_by_own_trials_says_nothing_of_others() -> None:
    decision = _decided(shipped(), Prior.OWN)
    assert decision.support is None
    # Records that were made before there was a support are read.
    record = to_json(decision)
    del record['support']
    assert from_json(Decision, record, WORLD) == decision
    del record['sentence']
    with pytest.raises(ValueError, match='Expected a Decision of'):
        from_json(Decision, record, WORLD)


def test_the_robots_model_speaks_of_an_object_it_never_tried() -> None:
    others = shipped().only(['lemon', 'chicken'])
    untried = others.counted('pear', prior=Prior.STRUCTURED)
    assert untried.trials == 0
    lent = others.borrowed('pear', LEFT, PUSH_RIGHT, Prior.STRUCTURED)
    assert {name for name, _ in lent} == {'lemon', 'chicken'}
    assert sum(worth for _, worth in lent) == pytest.approx(
        np.asarray(untried.prior)[LEFT, PUSH_RIGHT].sum()
    )
    assert others.borrowed('pear', LEFT, PUSH_RIGHT, Prior.OWN) == ()
    share = others.borrowed('pear', LEFT, PUSH_RIGHT, Prior.SHARED)
    assert share[0][1] == share[1][1] > 0
    known = shipped().objects['pear'].transition
    learned = others.goal_model('pear', prior=Prior.STRUCTURED).transition
    assert help_rate(learned[None], known[None]) < 0.2
