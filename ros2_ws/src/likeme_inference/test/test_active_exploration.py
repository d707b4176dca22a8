"""Active exploration: information gain, help rate, shared prior."""

import numpy as np
import pytest

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.paper_world import LEFT, OFFTABLE, PUSH_LEFT, PUSH_RIGHT, RIGHT, WORLD
from likeme_core.tabletop import Manner
from likeme_inference.experience.exploration_policy import InformationGain
from likeme_inference.experience.trial import no_counts
from likeme_inference.tabletop import TABLETOP, plan, shipped, spread
from likeme_inference.tabletop.active_exploration import help_rate, information_gain
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.imitation import ImitationSettings, decide
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts
from likeme_inference.tabletop.shared_prior import START, fit_weights, shared_prior
from likeme_inference.tabletop.transition_model import maximum_likelihood

AIMS = (0, 1, 2, 0, 1, 2)
CHANGES = ((0, 1), (0, 2), (1, 0), (1, 2))
TRANSITIONS = np.array([known.transition for known in shipped().objects.values()])


def slow_help_rate(model, world):
    """By `plan` and `spread`, one change after the other."""
    open_ = []
    for believed, truly in zip(model, world, strict=True):
        for x_i, g in CHANGES:
            best = plan(believed, np.arange(3) == g, 3, TABLETOP.stuck, TABLETOP.aimed[g])
            open_.append(1 - spread(truly, best, x_i, 3)[3, g])
    return np.mean(open_)


def test_help_rate_equals_that_of_executed_plans():
    assert help_rate(TRANSITIONS, TRANSITIONS) == pytest.approx(0.0475)
    rng = np.random.default_rng(0)
    for _ in range(20):
        model, world = rng.dirichlet(np.ones(3), size=(2, 3, 3, 6))
        assert help_rate(model, world) == pytest.approx(slow_help_rate(model, world))
        # Few trials and maximum likelihood: ties, and goals that nothing seems to reach.
        model = maximum_likelihood(rng.poisson(0.3, size=(3, 3, 6, 3)))
        assert help_rate(model, world) == pytest.approx(slow_help_rate(model, world))


def test_help_rate_is_zero_without_open_goals():
    nowhere = Domain(('a',), ('b',))
    assert help_rate(np.ones((1, 1, 1, 1)), np.ones((1, 1, 1, 1)), domain=nowhere) == 0


def test_random_but_known_rows_gain_nothing():
    alpha = np.full((3, 6, 3), 1e7 / 3)
    alpha[:, PUSH_RIGHT] = 1, 1, 1
    gain = information_gain(alpha, np.random.default_rng(0))
    assert gain.argmax() == np.ravel_multi_index((LEFT, PUSH_RIGHT), gain.shape)
    known = np.delete(gain, PUSH_RIGHT, axis=1)
    assert known.max() < 1e-6 * gain.max()
    assert not gain[OFFTABLE].any()


def test_pairs_that_affect_no_decision_gain_nothing():
    alpha = np.full((3, 6, 3), 0.01)
    for x_i in range(3):
        for a in WORLD.actions:
            alpha[x_i, a, a.target] = 1e6
    alpha[LEFT, PUSH_RIGHT] = 1, 1, 1
    # Placing does all there is to do without fail.
    assert information_gain(alpha, np.random.default_rng(1)).max() < 1e-6


def test_shared_prior_adds_a_share_of_other_objects_trials():
    counts = np.zeros((3, 3, 6, 3))
    counts[0, 0, 0] = 0, 10, 0
    prior = shared_prior(counts, START, AIMS)
    assert prior[1, 0, 0].tolist() == pytest.approx([1.0, 1.1, 0.1])
    assert prior[0, 0, 0].tolist() == pytest.approx([1.0, 0.1, 0.1])


def test_fitted_prior_favours_the_target_state():
    counts = np.zeros((3, 3, 6, 3))
    for x_i in (0, 1):
        for a in WORLD.actions:
            counts[:, x_i, a, a.target] = 10
    weights = fit_weights(counts, AIMS, rounds=3)
    assert weights.aimed > START.aimed
    assert weights.elsewhere < START.elsewhere


def test_information_gain_policy_stops_and_is_reproducible():
    counts = no_counts(WORLD, ('pear', 'lemon'))
    policy = InformationGain(trials=1)
    first, again = (policy.next(WORLD, counts, np.random.default_rng(3)) for _ in range(2))
    assert first == again
    assert first.x_i != OFFTABLE
    counts[first.object][first.x_i, first.action, 0] += 1
    assert policy.next(WORLD, counts, np.random.default_rng(3)) is None


def test_decisions_with_the_shared_prior():
    model = shipped()
    counts = np.array([known.counts for known in model.objects.values()], dtype=float)
    alpha = counts + shared_prior(counts, fit_weights(counts, AIMS, rounds=3), AIMS)
    for o, name in enumerate(model.objects):
        expected = alpha[o] / alpha[o].sum(axis=-1, keepdims=True)
        assert model.goal_model(name, prior=Prior.SHARED).transition == pytest.approx(expected)
        assert model.counted(name, 0.09).pseudo_counts == pytest.approx(counts[o] + 0.09)
    demo = Demonstration(0, '', 'pear', RIGHT, LEFT, Manner.PLACE, 0, 0)
    view = TableSnapshot(1, '', True, {'pear': RIGHT})
    decision = decide(model, ImitationSettings(prior=Prior.SHARED), demo, view, 1)
    row = alpha[0, RIGHT, PUSH_LEFT]
    assert decision.predicted_success == pytest.approx(row[LEFT] / row.sum())


def test_shared_prior_needs_actions_aimed_at_states():
    domain = Domain(('here', 'there'), ('go',))
    rows = (TrialCounts('ball', 0, 0, (1, 2), 'me'),)
    model = RobotModel('other', '1', {'me': 'Me.'}, rows, domain)
    with pytest.raises(ValueError, match='Expected every action aimed at a state'):
        model.counted('ball', prior=Prior.SHARED)
