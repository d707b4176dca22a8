"""Every posterior against enumeration of the joint P(G) P(A | G, x_i) P(X_f | x_i, A)."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from likeme_inference.tabletop.action_selection import choose
from likeme_inference.tabletop.domain import Action, Mode, State
from likeme_inference.tabletop.goal_inference import direct_policy, goal_posterior
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.transition_model import (
    FloatArray,
    IntArray,
    TransitionModel,
    maximum_likelihood,
)


@st.composite
def counts(draw: st.DrawFn, states: int | None = None, actions: int | None = None) -> IntArray:
    states = states or draw(st.integers(1, 6))
    actions = actions or draw(st.integers(1, 8))
    trials = st.sampled_from([0, 0, 1, 2, 3, 7, 10])
    return draw(hnp.arrays(np.int64, (states, actions, states), elements=trials))


def enumerate_transition(n: IntArray) -> dict[tuple[int, int, int], float]:
    states, actions, _ = n.shape
    table = {}
    for x, a, y in product(range(states), range(actions), range(states)):
        total = sum(int(n[x, a, z]) for z in range(states))
        table[x, a, y] = int(n[x, a, y]) / total if total else 1 / states
    return table


def enumerate_joint(n: IntArray, x: int, prior: FloatArray) -> dict[tuple[int, int, int], float]:
    """P(g, a, x_f | x_i = x), the policy by Bayes' rule with equally likely actions."""
    states, actions, _ = n.shape
    p = enumerate_transition(n)
    joint = {}
    for g, a, y in product(range(states), range(actions), range(states)):
        reach = math.fsum(p[x, b, g] for b in range(actions))
        policy = p[x, a, g] / reach if reach else 0.0
        joint[g, a, y] = float(prior[g]) * policy * p[x, a, y]
    return joint


@given(counts(), st.data())
@settings(max_examples=150, deadline=None)
def test_goal_posterior_sums_actions_out_of_the_joint(n: IntArray, data: st.DataObject) -> None:
    states = n.shape[0]
    x, y = data.draw(st.integers(0, states - 1)), data.draw(st.integers(0, states - 1))
    weights = data.draw(hnp.arrays(np.float64, states, elements=st.floats(0.01, 1)))
    prior = weights / weights.sum()
    joint = enumerate_joint(n, x, prior)
    mass = [
        math.fsum(v for (g, _, z), v in joint.items() if (g, z) == (goal, y))
        for goal in range(states)
    ]
    expected = [m / math.fsum(mass) for m in mass] if math.fsum(mass) else prior

    transition = maximum_likelihood(n)
    posterior = goal_posterior(transition, direct_policy(transition), x, y, prior)

    assert posterior == pytest.approx(expected, abs=1e-12)
    assert posterior.sum() == pytest.approx(1, abs=1e-12)


@given(counts(states=3, actions=6), st.sampled_from(State), st.sampled_from(State))
@settings(max_examples=150, deadline=None)
def test_choice_matches_the_joint(n: IntArray, x: State, g: State) -> None:
    p = enumerate_transition(n)
    reach = math.fsum(p[x, a, g] for a in Action)
    policy = [p[x, a, g] / reach if reach else 0.0 for a in Action]

    made = choose(TransitionModel(n), x, g, Action.PUSH_LEFT, Mode.INTERACTIVE, 0.5)

    assert made.action_probability == pytest.approx(policy, abs=1e-12)
    assert made.success_probability == pytest.approx([p[x, a, g] for a in Action], abs=1e-12)
    if made.action is not None:
        assert made.predicted == pytest.approx([p[x, made.action, y] for y in State], abs=1e-12)
        assert made.predicted_success == made.predicted[g]
        assert policy[made.action] == pytest.approx(max(policy), abs=1e-12)


@pytest.mark.parametrize('name', ['pear', 'lemon', 'chicken'])
@pytest.mark.parametrize('x', [State.LEFT, State.RIGHT, State.OFFTABLE])
@pytest.mark.parametrize('y', [State.LEFT, State.RIGHT, State.OFFTABLE])
def test_the_paper_s_models_match_the_joint(name: str, x: State, y: State) -> None:
    n = shipped().objects[name].counts
    prior = np.full(3, 1 / 3)
    joint = enumerate_joint(n, x, prior)
    mass = [math.fsum(joint[g, a, y] for a in Action) for g in State]
    expected = [m / math.fsum(mass) for m in mass] if math.fsum(mass) else prior

    transition = shipped().objects[name].transition
    assert goal_posterior(transition, direct_policy(transition), x, y, prior) == pytest.approx(
        expected, abs=1e-12
    )


@given(counts())
@settings(max_examples=100, deadline=None)
def test_no_row_is_ever_nan(n: IntArray) -> None:
    transition = maximum_likelihood(n)
    policy = direct_policy(transition).sum(axis=-1)

    assert transition.sum(axis=-1) == pytest.approx(np.ones(n.shape[:2]))
    assert np.all((np.abs(policy - 1) < 1e-12) | (policy == 0))
