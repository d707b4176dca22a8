"""Value iteration against every policy there is, and what its plans are worth."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from random_models import counts
from scipy import sparse

from likeme_core.paper_world import LEFT, PLACE_RIGHT, RIGHT, WORLD
from likeme_core.tabletop import State
from likeme_inference.tabletop.arrays import BoolArray, FloatArray, IntArray
from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.planning import NO_ACTION, Plan, plan, spread
from likeme_inference.tabletop.sparse import SparseGoalModel
from likeme_inference.tabletop.transition_model import TransitionModel, maximum_likelihood


def best_by_enumeration(
    p: FloatArray, goal: BoolArray, stuck: BoolArray, budget: int
) -> list[float]:
    """Greatest P(goal reached) over all policies that may choose anew at every step and state."""
    states, actions = p.shape[:2]
    free = [x for x in range(states) if not goal[x] and not stuck[x]]
    best = np.zeros(states)
    for chosen in product(product(range(actions), repeat=len(free)), repeat=budget):
        value = goal.astype(float)
        for step in chosen:
            moved = value.copy()
            for x, a in zip(free, step, strict=True):
                moved[x] = p[x, a] @ value
            value = moved
        best = np.maximum(best, value)
    return best.tolist()


@given(counts(states=3, actions=2), st.integers(0, 3), st.data())
@settings(max_examples=60, deadline=None)
def test_value_iteration_is_the_best_of_all_policies(
    n: IntArray, budget: int, data: st.DataObject
) -> None:
    flags = hnp.arrays(bool, 3)
    goal, stuck = data.draw(flags), data.draw(flags)
    p = maximum_likelihood(n)
    found = plan(p, goal, budget, stuck)

    expected = best_by_enumeration(p, goal, stuck, budget)
    assert found.value[budget] == pytest.approx(expected, rel=0, abs=1e-12)
    for x in range(3):
        reached = spread(p, found, x, budget)[budget]
        assert reached[goal].sum() == pytest.approx(found.value[budget, x], rel=0, abs=1e-12)
        assert reached.sum() == pytest.approx(1)


@given(counts(), st.sampled_from([0.0, 0.09]), st.data())
@settings(max_examples=60, deadline=None)
def test_sparse_values_are_the_same(n: IntArray, alpha: float, data: st.DataObject) -> None:
    states, actions, _ = n.shape
    goal = data.draw(st.integers(0, states - 1))
    rows = sparse.csr_array(n.reshape(states * actions, states))
    thin = SparseGoalModel.of_counts(rows, actions, alpha)
    dense = plan(TransitionModel(n, alpha).transition, np.arange(states) == goal, 4)

    assert thin.value(goal, 4) == pytest.approx(dense.value, rel=0, abs=1e-12)


def tabletop_plan(name: str, goal: State, budget: int) -> Plan:
    transition = shipped().objects[name].transition
    return plan(transition, np.arange(3) == goal, budget, TABLETOP.stuck, TABLETOP.aimed[goal])


@pytest.mark.parametrize(
    ('budget', 'expected'), [(1, 0.7167), (2, 0.89), (3, 0.9525), (5, 0.9888)]
)
def test_values_of_several_actions(budget: int, expected: float) -> None:
    """Means over 3 objects and 4 changes that were computed independently of this code."""
    changes = [(0, 1), (0, 2), (1, 0), (1, 2)]
    values = [
        tabletop_plan(name, WORLD.state(g), budget).value[budget, x]
        for name in shipped().objects
        for x, g in changes
    ]

    assert np.mean(values) == pytest.approx(expected, abs=5e-5)


def test_plans_for_all_objects_in_one_call() -> None:
    worlds = np.array([known.transition for known in shipped().objects.values()])
    goal, budget = np.arange(3) == LEFT, 3
    found = plan(worlds, goal, budget, TABLETOP.stuck, TABLETOP.aimed[LEFT])
    reached = spread(worlds, found, RIGHT, budget)

    assert found.quality.shape == (3, budget + 1, 3, 6)
    for o, name in enumerate(shipped().objects):
        alone = tabletop_plan(name, LEFT, budget)
        for many, one in zip(found, alone, strict=True):
            assert many[o] == pytest.approx(one, rel=0, abs=1e-15)
        expected = spread(worlds[o], alone, RIGHT, budget)
        assert reached[o] == pytest.approx(expected, rel=0, abs=1e-15)


def test_plans_avoid_the_edge() -> None:
    """Action 0 succeeds more often at once, but what it loses is lost; action 1 may try again."""
    p = np.zeros((3, 2, 3))
    p[1, 0], p[1, 1] = (0.6, 0.0, 0.4), (0.5, 0.5, 0.0)
    p[0, :, 0] = p[2, :, 2] = 1
    found = plan(p, np.array([True, False, False]), 3, np.array([False, False, True]))

    assert found.action[:, 1].tolist() == [NO_ACTION, 0, 1, 1]
    assert found.value[:, 1].tolist() == pytest.approx([0, 0.6, 0.8, 0.9])
    assert found.action[:, [0, 2]].tolist() == [[NO_ACTION] * 2] * 4


def test_ties_go_to_the_aimed_action() -> None:
    p = maximum_likelihood(np.zeros((3, 6, 3)))
    prefer = TABLETOP.aimed[RIGHT]

    assert plan(p, np.arange(3) == 1, 2).action[2, 0] == 0
    assert plan(p, np.arange(3) == 1, 2, prefer=prefer).action[2, 0] == PLACE_RIGHT


def test_a_small_success_probability_is_preferred_to_none() -> None:
    p = np.array([[[1.0, 0.0], [1 - 1e-13, 1e-13]], [[0.0, 1.0], [0.0, 1.0]]])

    assert plan(p, np.array([False, True]), 1).action[1, 0] == 1


def test_invalid_arguments_of_plan_are_rejected() -> None:
    p = maximum_likelihood(np.zeros((3, 6, 3)))

    with pytest.raises(ValueError, match='transition to sum to 1, got 10'):
        plan(shipped().objects['pear'].counts.astype(float), np.arange(3) == 1, 1)
    with pytest.raises(ValueError, match='6 actions, each once, got '):
        plan(p, np.arange(3) == 1, 1, prefer=(0, 0))
    with pytest.raises(ValueError, match='x_i from 0 to 2, got -1'):
        spread(p, plan(p, np.arange(3) == 1, 2), -1, 2)
    with pytest.raises(ValueError, match='0 actions or more, got -1'):
        plan(p, np.arange(3) == 1, -1)
    with pytest.raises(ValueError, match=r'of shape \(3,\), got \(2,\)'):
        plan(p, np.array([True, False]), 1)
    with pytest.raises(ValueError, match='at most 2 actions, got 3'):
        spread(p, plan(p, np.arange(3) == 1, 2), 0, 3)
