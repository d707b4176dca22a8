"""Random models, and the joint P(G) P(A | G, x_i) P(X_f | x_i, A) enumerated by loops."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from likeme_inference.tabletop.arrays import FloatArray, IntArray

Joint = dict[tuple[int, ...], float]


@st.composite
def counts(draw: st.DrawFn, states: int | None = None, actions: int | None = None) -> IntArray:
    """Counts of up to 6 states and 8 actions, with rows never tried and states never reached."""
    states = states or draw(st.integers(1, 6))
    actions = actions or draw(st.integers(1, 8))
    trials = st.sampled_from([0, 0, 0, 1, 2, 3, 7, 10])
    return draw(hnp.arrays(np.int64, (states, actions, states), elements=trials))


def distributions(size: int) -> st.SearchStrategy[FloatArray]:
    """Distributions, some with zeros."""
    weight = st.one_of(st.just(0.0), st.floats(1e-3, 1))
    weights = hnp.arrays(np.float64, size, elements=weight)
    return weights.filter(lambda w: w.sum() > 0).map(lambda w: w / w.sum())


class World(NamedTuple):
    """A random model and what is observed of it."""

    counts: IntArray
    others: IntArray
    goals: FloatArray
    prior: FloatArray
    x_i: FloatArray
    x_f: FloatArray


@st.composite
def worlds(draw: st.DrawFn) -> World:
    """Own and another's counts, up to 6 goals that are sets of states, a prior, soft evidence."""
    n = draw(counts())
    states, actions, _ = n.shape
    others = draw(counts(states, actions))
    size = draw(st.integers(1, 6))
    members = hnp.arrays(np.float64, (size, states), elements=st.sampled_from([0.0, 1.0]))
    soft = distributions(states)
    return World(n, others, draw(members), draw(distributions(size)), draw(soft), draw(soft))


def transition_of(n: IntArray, alpha: float = 0.0) -> Joint:
    """p(x_f | x_i, a) by definition."""
    states, actions, _ = n.shape
    table: Joint = {}
    for x, a, y in product(range(states), range(actions), range(states)):
        total = sum(int(n[x, a, z]) for z in range(states)) + alpha * states
        table[x, a, y] = (int(n[x, a, y]) + alpha) / total if total else 1 / states
    return table


def policy_of(p: Joint, goals: FloatArray, shape: Sequence[int]) -> Joint:
    """P(a | g, x_i) = P(a | x_i, X_f fulfils g), by Bayes' rule with equally likely actions."""
    states, actions = shape[:2]
    table: Joint = {}
    for x, g in product(range(states), range(len(goals))):
        to_goal = [
            math.fsum(p[x, a, y] for y in range(states) if goals[g, y]) for a in range(actions)
        ]
        for a in range(actions):
            table[x, g, a] = to_goal[a] / math.fsum(to_goal) if any(to_goal) else 0.0
    return table


def joint_of(world: World, acting: Joint) -> Joint:
    """P(x_i, g, a, x_f) of whoever acts, both states weighted by their evidence."""
    states, actions, _ = world.counts.shape
    policy = policy_of(acting, world.goals, world.counts.shape)
    space = product(range(states), range(len(world.goals)), range(actions), range(states))
    return {
        (x, g, a, y): float(world.x_i[x])
        * float(world.prior[g])
        * policy[x, g, a]
        * acting[x, a, y]
        * float(world.x_f[y])
        for x, g, a, y in space
    }


def marginal(joint: Joint, axis: int, size: int) -> list[float] | None:
    """The distribution over one variable; None if nothing is possible."""
    mass = [math.fsum(v for key, v in joint.items() if key[axis] == i) for i in range(size)]
    total = math.fsum(mass)
    return [m / total for m in mass] if total > 0 else None
