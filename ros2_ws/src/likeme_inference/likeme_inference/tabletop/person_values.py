"""Values of a person's acts on one object: what a goal is worth, and what each act loses.

A person who wants an object in g acts until it is there or gives it up. With a cost c of each act

    V_g(x) = max(1 if x fulfils g else 0, max over a of -c + sum over x' of p(x' | x, a) V_g(x')).

The advantage of an act is -c + sum over x' of p(x' | x, a) V_g(x') - V_g(x), that of leaving the
object alone [x fulfils g] - V_g(x); both are at most 0. "Don't care" is the goal that each state
fulfils: an act on such an object only costs.

With additive rewards and costs these are the exact optimal values of the whole table: the value of
a joint goal is the sum over objects, and the advantage of an act is that of its own object.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.arrays import BoolArray, FloatArray

#: Change of a value at which the iteration ends, and the greatest number of rounds.
PRECISION, ROUNDS = 1e-13, 10_000


class PersonValues(NamedTuple):
    """Advantages of one object, at most 0.

    Attributes:
        act: of each action, shape [a, x, g]; the last g is "don't care".
        leave: of leaving the object as it is, shape [x, g].
    """

    act: FloatArray
    leave: FloatArray


def person_values(transition: FloatArray, cost: float) -> PersonValues:
    """Optimal values by value iteration.

    Args:
        transition: of the person, shape [x_i, a, x_f].
        cost: of an act, above 0, in units of one object brought to its goal.

    Raises:
        ValueError: a cost of 0 or less.
    """
    if not cost > 0:
        raise ValueError(f'Expected a cost of an act above 0, got {cost:g}.')
    states = len(transition)
    fulfilled = np.concatenate([np.eye(states), np.ones((states, 1))], axis=1)  # [x, g]
    value = fulfilled
    for _ in range(ROUNDS):
        acted = np.einsum('xay,yg->axg', transition, value) - cost
        better = np.maximum(fulfilled, acted.max(axis=0))
        done = np.abs(better - value).max() < PRECISION
        value = better
        if done:
            break
    acted = np.einsum('xay,yg->axg', transition, value) - cost
    return PersonValues(np.minimum(acted - value, 0.0), fulfilled - value)


def skilled(
    transition: FloatArray, targets: tuple[int, ...], stuck: BoolArray, skill: float
) -> FloatArray:
    """A person's p(X_f | X_i, A): the robot's, mixed with actions that reach what they aim at.

    p_s(x_f | x_i, a) = (1 - s) p(x_f | x_i, a) + s [x_f = target of a]; a state out of reach is
    never left.

    Args:
        transition: the robot's own, shape [x_i, a, x_f].
        targets: state that each action aims at, shape [a].
        stuck: states out of reach, shape [x].
        skill: s; 0: "like me", 1: never fails.
    """
    mixed = (1 - skill) * transition
    mixed[:, np.arange(len(targets)), list(targets)] += skill
    mixed[stuck] = np.eye(len(transition))[stuck][:, None]
    return np.asarray(mixed)
