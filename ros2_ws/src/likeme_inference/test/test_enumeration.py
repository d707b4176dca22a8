"""Every posterior against enumeration of the joint P(G) P(A | G, x_i) P(X_f | x_i, A)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_models import World, counts, joint_of, marginal, policy_of, transition_of, worlds
from scipy import sparse

from likeme_core.paper_world import PUSH_LEFT, WORLD
from likeme_core.tabletop import Mode, State
from likeme_inference.tabletop.action_selection import choose
from likeme_inference.tabletop.arrays import IntArray
from likeme_inference.tabletop.dirichlet import sample_transitions
from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.goal_exploration import explored_policy
from likeme_inference.tabletop.goal_inference import (
    direct_policy,
    goal_posterior,
    posterior_table,
)
from likeme_inference.tabletop.goal_model import GoalModel
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.sparse import SparseGoalModel
from likeme_inference.tabletop.transition_model import TransitionModel, maximum_likelihood

EXACT = {'rel': 0, 'abs': 1e-12}
MANY = settings(max_examples=150, deadline=None)


def model_of(world: World) -> GoalModel:
    own, other = maximum_likelihood(world.counts), maximum_likelihood(world.others)
    return GoalModel.of(own, world.goals, world.prior, other)


def certain(world: World, x: int, y: int) -> World:
    eye = np.eye(len(world.counts))
    return world._replace(x_i=eye[x], x_f=eye[y])


@given(worlds())
@MANY
def test_goal_posterior_with_soft_evidence_and_another_demonstrator(world: World) -> None:
    joint = joint_of(world, transition_of(world.others))
    expected = marginal(joint, 1, len(world.goals)) or world.prior

    posterior = model_of(world).goal_posterior(world.x_i, world.x_f)

    assert posterior == pytest.approx(expected, **EXACT)
    assert posterior.sum() == pytest.approx(1, **EXACT)


@given(worlds(), st.data())
@MANY
def test_goal_posterior_with_certain_and_half_certain_evidence(
    world: World, data: st.DataObject
) -> None:
    states = st.integers(0, len(world.counts) - 1)
    x, y = data.draw(states), data.draw(states)
    other = transition_of(world.others)
    model, eye = model_of(world), np.eye(len(world.counts))
    for evidence, seen in [
        ((x, y), certain(world, x, y)),
        ((x, world.x_f), world._replace(x_i=eye[x])),
        ((world.x_i, y), world._replace(x_f=eye[y])),
    ]:
        expected = marginal(joint_of(seen, other), 1, len(world.goals)) or world.prior
        assert model.goal_posterior(*evidence) == pytest.approx(expected, **EXACT)


@given(worlds())
@MANY
def test_action_inference_and_prediction(world: World) -> None:
    p, (states, actions, _) = transition_of(world.counts), world.counts.shape
    joint = {(x, a, y): float(world.x_i[x]) * p[x, a, y] * float(world.x_f[y]) for x, a, y in p}
    model = model_of(world)

    explained = model.action_posterior(world.x_i, world.x_f)
    expected = marginal(joint, 1, actions) or [1 / actions] * actions
    assert explained == pytest.approx(expected, **EXACT)
    for a in range(actions):
        blind = {(x, y): float(world.x_i[x]) * p[x, a, y] for x, b, y in p if a == b}
        assert model.predict(world.x_i, a) == pytest.approx(marginal(blind, 1, states), **EXACT)


@given(worlds())
@MANY
def test_policies(world: World) -> None:
    p, model = transition_of(world.counts), model_of(world)
    policy = policy_of(p, world.goals, world.counts.shape)
    explored = explored_policy(model.transition, goals=world.goals)
    for (x, g, a), expected in policy.items():
        to_goal = math.fsum(p[x, a, y] for y in range(len(world.counts)) if world.goals[g, y])
        assert model.policy[x, g, a] == pytest.approx(expected, **EXACT)
        assert model.success(x, g)[a] == pytest.approx(to_goal, **EXACT)
        assert explored[x, g, a] * math.fsum(
            policy[x, g, b] * float(model.success(x, g)[b]) for b in range(explored.shape[-1])
        ) == pytest.approx(expected * to_goal, **EXACT)
    mixed = [
        math.fsum(float(world.x_i[x]) * policy[x, 0, a] for x in range(len(world.x_i)))
        for a in range(explored.shape[-1])
    ]
    expected_row = [m / math.fsum(mixed) for m in mixed] if any(mixed) else mixed
    assert model.action_for(world.x_i, 0) == pytest.approx(expected_row, **EXACT)


@given(worlds(), st.integers(1, 5), st.data())
@settings(max_examples=60, deadline=None)
def test_a_batch_is_its_single_demonstrations(
    world: World, size: int, data: st.DataObject
) -> None:
    index = st.lists(st.integers(0, len(world.counts) - 1), min_size=size, max_size=size)
    x, y = np.array(data.draw(index)), np.array(data.draw(index))
    soft = np.random.default_rng(size).dirichlet(np.ones(len(world.counts)), size)
    model = model_of(world)
    for here, there in [(x, y), (x, soft), (soft, y), (soft, soft[::-1]), (x, world.x_f)]:
        many = model.goal_posterior(here, there)
        for k in range(size):
            one = model.goal_posterior(here[k], there if there is world.x_f else there[k])
            assert many[k] == pytest.approx(one, **EXACT)


@given(counts(), st.sampled_from([0.0, 0.09, 1.0]), st.data())
@MANY
def test_sparse_models_agree_with_dense_ones(
    n: IntArray, alpha: float, data: st.DataObject
) -> None:
    states, actions, _ = n.shape
    x, y = data.draw(st.integers(0, states - 1)), data.draw(st.integers(0, states - 1))
    dense = GoalModel.of(TransitionModel(n, alpha).transition)
    rows = sparse.csr_array(n.reshape(states * actions, states))
    thin = SparseGoalModel.of_counts(rows, actions, alpha)

    assert thin.goal_posterior(x, y) == pytest.approx(dense.goal_posterior(x, y), **EXACT)
    assert thin.action_posterior(x, y) == pytest.approx(dense.action_posterior(x, y), **EXACT)
    assert thin.success(x, y) == pytest.approx(dense.success(x, y), **EXACT)
    scale = rows.astype(float)
    SparseGoalModel.of_counts(scale, actions, alpha)
    assert (scale != rows).nnz == 0, "The counts stay the caller's."
    assert thin.predict(x, actions - 1) == pytest.approx(dense.predict(x, actions - 1), **EXACT)


@given(counts(states=3, actions=6), st.sampled_from(WORLD.states), st.sampled_from(WORLD.states))
@MANY
def test_choice_matches_the_joint(n: IntArray, x: State, g: State) -> None:
    p = transition_of(n)
    policy = policy_of(p, np.eye(3), n.shape)
    model = GoalModel.of(maximum_likelihood(n), TABLETOP)

    made = choose(model, x, g, PUSH_LEFT, Mode.INTERACTIVE, 0.5)

    assert made.action_probability == pytest.approx(
        [policy[x, g, a] for a in WORLD.actions], **EXACT
    )
    assert made.success_probability == pytest.approx([p[x, a, g] for a in WORLD.actions], **EXACT)
    if made.action is not None:
        assert made.predicted == pytest.approx(
            [p[x, made.action, y] for y in WORLD.states], **EXACT
        )
        assert made.predicted_success == made.predicted[g]
        assert policy[x, g, made.action] == pytest.approx(max(made.action_probability), **EXACT)


@pytest.mark.parametrize('name', ['pear', 'lemon', 'chicken'])
@pytest.mark.parametrize('x', WORLD.states)
@pytest.mark.parametrize('y', WORLD.states)
def test_the_paper_s_models_match_the_joint(name: str, x: State, y: State) -> None:
    n, prior, eye = shipped().objects[name].counts, np.full(3, 1 / 3), np.eye(3)
    p = transition_of(n)
    joint = joint_of(World(n, n, eye, prior, eye[x], eye[y]), p)
    expected = marginal(joint, 1, 3) or prior

    transition = shipped().objects[name].transition
    direct = goal_posterior(transition, direct_policy(transition), x, y, prior)
    assert direct == pytest.approx(expected, **EXACT)
    assert shipped().goal_model(name).goal_posterior(x, y) == pytest.approx(expected, **EXACT)


def test_batch_over_objects() -> None:
    objects = list(shipped().objects)
    transition = np.array([shipped().objects[name].transition for name in objects])
    policy = direct_policy(transition)
    table = posterior_table(transition, policy, np.full(3, 1 / 3))

    assert table.shape == (3, 3, 3, 3)
    for o, name in enumerate(objects):
        model = shipped().goal_model(name)
        assert policy[o] == pytest.approx(model.policy, **EXACT)
        assert table[o] == pytest.approx(model.goal_posterior(*np.indices((3, 3))), **EXACT)
    many = sample_transitions(shipped().objects['pear'], np.random.default_rng(0), 50)
    spread_out = posterior_table(many, direct_policy(many), np.full(3, 1 / 3))
    assert spread_out.shape == (50, 3, 3, 3)
    assert spread_out.sum(axis=-1) == pytest.approx(np.ones((50, 3, 3)))


@given(counts(), st.sampled_from([0.0, 0.09]))
@MANY
def test_no_row_is_ever_nan(n: IntArray, alpha: float) -> None:
    model = GoalModel.of(TransitionModel(n, alpha).transition)
    policy = model.policy.sum(axis=-1)
    everything = model.goal_posterior(*np.indices((len(n), len(n))))

    assert model.transition.sum(axis=-1) == pytest.approx(np.ones(n.shape[:2]))
    assert np.all((np.abs(policy - 1) < 1e-12) | (policy == 0))
    assert everything.sum(axis=-1) == pytest.approx(np.ones((len(n), len(n))))


@given(counts(), st.randoms(use_true_random=False))
@settings(max_examples=60, deadline=None)
def test_the_order_of_trials_does_not_matter(n: IntArray, random: object) -> None:
    trials = [key for key, times in np.ndenumerate(n) for _ in range(min(int(times), 2))]
    shuffled = trials.copy()
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    models = []
    for order in (trials, shuffled):
        model = TransitionModel.untried(*n.shape[:2], 0.09)
        for x_i, a, x_f in order:
            model = model.add(x_i, a, x_f)
        models.append(model)
    half = len(trials) // 2
    parts = [TransitionModel.untried(*n.shape[:2], 0.09) for _ in range(2)]
    for k, trial in enumerate(trials):
        parts[k < half] = parts[k < half].add(*trial)

    assert np.array_equal(models[0].counts, models[1].counts)
    assert np.array_equal(parts[0].merge(parts[1]).counts, models[0].counts)
    assert models[0].trials == len(trials)
