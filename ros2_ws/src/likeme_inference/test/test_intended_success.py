"""Success at the goal that was meant: exact integrals, limit cases, calibration."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import hyp1f1, poch

from likeme_core.tabletop import Mode
from likeme_inference.tabletop import GoalModel, TransitionModel, shipped
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.asking import choose_to_keep
from likeme_inference.tabletop.dirichlet import aimed_prior
from likeme_inference.tabletop.domain import Policy
from likeme_inference.tabletop.intended_success import (
    intended_plan_success,
    intended_success,
    meant,
)
from likeme_inference.tabletop.prior import Prior

STATES, ACTIONS = 3, 2
PRIOR = np.array(
    [[[2.0, 1, 0.5], [0.7, 1.5, 1]], [[1.0, 2, 0.5], [1, 1, 0.3]], [[0.5, 0.5, 3], [1, 1, 1]]]
)


def estimated(counts: FloatArray | None = None, prior: FloatArray = PRIOR) -> GoalModel:
    n = np.zeros(prior.shape, int) if counts is None else counts.astype(int)
    return GoalModel.of(TransitionModel(n, prior))


def integral(alpha: FloatArray, g: int, f: int, then: int | None = None) -> float:
    """E[P(f | g, theta) theta[then, g]] of one row's Dirichlets alpha[a, x_f], by quadrature.

    1 / S = integral of exp(-t S) over t, which factorises over actions; S = sum of theta[a, g].
    """

    def moment(a: int, m: int, n: int, t: float) -> float:
        """E[theta_g^m theta_f^n exp(-t theta_g)] of an action."""
        own, total = alpha[a], alpha[a].sum()
        at = m + n if f == g else m
        rest = 1.0 if f == g else poch(own[f], n)
        scale = poch(own[g], at) * rest / poch(total, m + n)
        return float(scale * hyp1f1(own[g] + at, total + m + n, -t))

    def at(t: float) -> float:
        return sum(
            np.prod([
                moment(b, (b == a) + (b == then), int(b == a), t) for b in range(len(alpha))
            ])
            for a in range(len(alpha))
        )  # fmt: skip

    near, far = quad(at, 0, 1)[0], quad(lambda u: at(1 / u) / u**2, 0, 1)[0]
    return float(near + far)


@pytest.mark.parametrize('x_f', [0, 1, 2])
def test_it_is_the_integral_over_goals_and_transitions(x_f: int) -> None:
    model, x = estimated(), 0
    belief = meant(model, x, x_f)
    explained = {g: integral(PRIOR[x], g, x_f) for g in (1, 2)}
    total = sum(explained.values())
    by_hand = [0.0, *(explained[g] / total for g in (1, 2))]
    assert belief.sum(axis=0) == pytest.approx(by_hand, abs=0.01)
    success = [sum(integral(PRIOR[x], g, x_f, a) for g in (1, 2)) / total for a in range(ACTIONS)]
    assert intended_success(model, x, belief) == pytest.approx(success, abs=0.01)


def test_it_promises_what_is_realised_where_worlds_come_from_the_prior() -> None:
    """The paper's posterior, with the means of the rows, promises less."""
    rng, prior = np.random.default_rng(0), aimed_prior(STATES, (0, 1, 2) * 2)
    totals, episodes = np.zeros(3), 0.0
    for _ in range(100):
        world = np.array([[rng.dirichlet(row) for row in rows] for rows in prior])
        person, model = GoalModel.of(world), estimated(rng.multinomial(2, world), prior)
        for x, x_f in product(range(STATES), repeat=2):
            # Of each goal, all but that of x as likely.
            shown = np.where(np.arange(STATES) == x, 0.0, person.policy[x] @ world[x, :, x_f])
            together = intended_success(model, x, meant(model, x, x_f))
            apart = intended_success(model, x, model.goal_posterior(x, x_f))
            a = int(together.argmax())
            promised = together[a], apart[a]
            totals += [*(shown.sum() * np.array(promised)), shown @ world[x, a]]
            episodes += shown.sum()
    together, apart, realised = totals / episodes
    assert together == pytest.approx(realised, abs=0.01)
    assert apart < realised - 0.05


def test_who_acts_does_not_mean_what_is_there_already() -> None:
    pear = shipped().goal_model('pear')
    belief = meant(pear, 0, 1)
    assert belief.shape == (1, 3)
    assert belief[0, 0] == 0
    paper = pear.goal_posterior(0, 1)
    assert belief[0, 1] / belief[0, 2] == pytest.approx(paper[1] / paper[2])
    assert paper[0] > 0
    # Where it was is not certain.
    assert meant(pear, [0.8, 0.2, 0.0], 1)[0, 0] > 0


def test_a_change_that_no_goal_explains_leaves_the_prior() -> None:
    certain = GoalModel.of(np.eye(3)[:, None].repeat(2, axis=1), prior=[0.2, 0.3, 0.5])
    assert meant(certain, 0, 1).tolist() == [[0.2, 0.3, 0.5]]


def test_a_belief_in_goals_alone_gives_the_mean() -> None:
    for model in (estimated(), shipped().goal_model('pear')):
        belief = np.array([0.2, 0.5, 0.3])
        by_hand = sum(belief[g] * model.success(0, g) for g in range(3))
        assert intended_success(model, 0, belief) == pytest.approx(by_hand)


@pytest.mark.parametrize('policy', list(Policy))
@pytest.mark.parametrize('prior', [Prior.OWN, Prior.SHARED])
def test_a_plan_of_one_action_is_that_action(policy: Policy, prior: Prior) -> None:
    lemon = shipped().goal_model('lemon', policy=policy, prior=prior)
    belief = meant(lemon, 0, 1)
    action = int(lemon.success(0, 1).argmax())
    one, three = (intended_plan_success(lemon, 0, belief, 1, left) for left in (1, 3))
    assert one == pytest.approx(float(intended_success(lemon, 0, belief)[action]))
    assert one < three < float(lemon.plan(1, 3).value[3, 0])
    assert choose_to_keep(lemon, 0, 1, belief, Mode.SEQUENTIAL, 0.0, 3)[1] == pytest.approx(three)


def test_an_action_that_cannot_be_taken_leaves_the_object_there() -> None:
    model = shipped().goal_model('lemon', prior=Prior.SHARED)
    belief, blocked = meant(model, 0, 1), model.without(0, [2])
    assert meant(blocked, 0, 1) == pytest.approx(belief)
    successes = intended_success(model, 0, belief)
    assert intended_success(blocked, 0, belief)[2] == pytest.approx(0, abs=1e-12) != successes[2]
    assert np.delete(intended_success(blocked, 0, belief) - successes, 2) == pytest.approx(0)


def test_relative_frequencies_and_other_demonstrators_are_certain() -> None:
    counts = TransitionModel(np.ones((3, 2, 3), int), PRIOR)
    assert GoalModel.of(counts).estimated is not None
    assert GoalModel.of(TransitionModel(counts.counts)).estimated is None
    assert GoalModel.of(counts, demonstrator=counts).estimated is None


def test_relative_frequencies_choose_and_what_they_promise_is_uncertain() -> None:
    model = shipped()
    chosen, promising = model.goal_model('pear'), model.promising_model('pear')
    assert np.array_equal(promising.transition, chosen.transition)
    assert np.array_equal(promising.goal_posterior(0, 1), chosen.goal_posterior(0, 1))
    assert promising is model.promising_model('pear')
    assert promising.estimated is not None
    alpha = model.counted('pear', prior=Prior.SHARED).pseudo_counts
    assert np.array_equal(promising.estimated.pseudo_counts, alpha)
    # A prior that was chosen is kept, and without aims there is none to borrow by.
    assert model.promising_model('pear', concentration=0.5) is model.goal_model(
        'pear', concentration=0.5
    )
    aimless = replace(model, domain=replace(model.domain, aims={}))
    assert aimless.promising_model('pear').estimated is None


def test_the_best_of_relative_frequencies_is_not_what_it_promises() -> None:
    """Robots of 10 trials a pair in the paper's table, who take the best action of each change."""
    rng, real, pairs = np.random.default_rng(0), shipped(), [(0, 1), (0, 2), (1, 0), (1, 2)]
    table = {name: known.transition for name, known in real.objects.items()}
    totals = np.zeros(3)
    for _ in range(12):
        rows = tuple(
            row._replace(counts=tuple(rng.multinomial(10, table[row.object][row.x_i, row.action])))
            for row in real.rows
        )
        robot = replace(real, rows=rows)
        for name, (x, g) in product(table, pairs):
            believed = np.eye(3)[g]
            own, promising = robot.goal_model(name), robot.promising_model(name)
            a = int(own.success(x, g).argmax())
            belief = np.full((len(meant(promising, x, g)), 1), 1 / 2048) * believed
            by_draws = float(intended_success(promising, x, belief)[a])
            totals += [own.success(x, g)[a], by_draws, table[name][x, a, g]]
    certain, uncertain, realised = totals / (12 * 12)
    assert certain > realised + 0.03
    assert uncertain == pytest.approx(realised, abs=0.02)


@pytest.mark.parametrize(
    ('call', 'message'),
    [
        (lambda model: intended_success(model, 0, [1.0, 1, 0]), 'to sum to 1'),
        (lambda model: intended_success(model, 3, [1.0, 0, 0]), '3'),
        (lambda model: intended_success(model, 0, np.full((7, 3), 1 / 21)), r'shape \(7, 3\)'),
        (lambda model: meant(model, [0, 1], 2), 'Expected one demonstration, got several'),
    ],
)
def test_bad_arguments_are_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(estimated())


def test_success_at_the_goal_that_was_meant_is_less_than_at_the_likeliest() -> None:
    pear = shipped().goal_model('pear')
    belief = pear.goal_posterior(0, 2)
    meant = intended_success(pear, 0, belief)
    by_hand = [sum(belief[g] * pear.transition[0, a, g] for g in range(3)) for a in range(6)]
    assert meant == pytest.approx(by_hand)
    goal = int(belief.argmax())
    assert meant.max() < pear.success(0, goal).max()
    assert intended_success(pear, 0, np.eye(3)[goal]) == pytest.approx(pear.success(0, goal))
