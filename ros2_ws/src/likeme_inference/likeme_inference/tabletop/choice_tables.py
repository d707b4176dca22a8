"""P(o, a | x, goal, person) and P(stop | x, goal, person) of the person's choice (goal_space.py).

The sum Z over all acts and stopping depends on the states of all objects. Up to LARGEST entries
its tables are computed at once; beyond, for each table state when it is first needed.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from functools import reduce
from itertools import product

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray, IntArray
from likeme_inference.tabletop.person_values import PersonValues

#: Entries over table states, goals and people up to which all are computed at once.
LARGEST = 4_000_000

#: What is known of an object's state: its number, or a distribution, shape [x].
Where = int | FloatArray


class ChoiceTables:
    """The choice of every kind of person for every goal, from advantages and rationalities."""

    def __init__(
        self,
        values: list[list[PersonValues]],
        rationality: FloatArray,
        numbers: IntArray,
        giving_up: float,
    ) -> None:
        """Compute the tables.

        Args:
            values: of each object and kind of person.
            rationality: of each kind, shape [person].
            numbers: position of each goal's entry in the last axis of the values, shape
                [goal, object].
            giving_up: probability to stop for no reason of the goal's.
        """
        self._numbers, self._giving_up = numbers, giving_up
        self._states = values[0][0].leave.shape[0]
        #: [object][a, x, g, person]: numerators of acts.
        self._act = [
            np.exp(np.stack([v.act for v in kinds], axis=-1) * rationality) for kinds in values
        ]
        self._acts = [act.sum(axis=0) for act in self._act]
        self._leave = [
            np.stack([v.leave for v in kinds], axis=-1) * rationality for kinds in values
        ]
        size = self._states ** len(values) * len(numbers) * len(rationality)
        self._all = self._every() if size <= LARGEST else None
        self._found: OrderedDict[tuple[int, ...], tuple[FloatArray, FloatArray]] = OrderedDict()
        self._kept = max(1, LARGEST // (len(numbers) * len(rationality)))

    def numerator(self, o: int, a: int, x: int) -> FloatArray:
        """exp(beta A_o(x, g, a)) of each entry g of a goal, shape [g, person]; see `by_goal`."""
        return np.asarray(self._act[o][a, x])

    def by_goal(self, o: int, table: FloatArray) -> FloatArray:
        """A table [g, person] of an object as [goal, person]."""
        return np.asarray(table.take(self._numbers[:, o], axis=0))

    def scale(self, o: int, x: Sequence[int], where: list[Where]) -> list[FloatArray]:
        """(1 - e) / Z with the object o in each state of x, the others as in `where`.

        Each of shape [goal, person].
        """
        if self._all is None:
            return [self._summed(0, [*where[:o], each, *where[o + 1 :]]) for each in x]
        others, table = [w for k, w in enumerate(where) if k != o], self._all[1][o]
        return self._averaged([table[each] for each in x], others)

    def stop(self, where: list[Where]) -> FloatArray:
        """P(stop), shape [goal, person]."""
        if self._all is None:
            return self._summed(1, where)
        return self._averaged([self._all[0]], where)[0]

    def _averaged(self, tables: list[FloatArray], where: list[Where]) -> list[FloatArray]:
        """Tables [x, goal, person] at, or averaged over, the states of some objects."""
        at = [w for w in where if isinstance(w, int)]
        if len(at) == len(where):
            flat = reduce(lambda whole, x: whole * self._states + x, at, 0)
            return [table[flat] for table in tables]
        each = [np.eye(self._states)[w] if isinstance(w, int) else w for w in where]
        weight = reduce(np.multiply.outer, each).ravel()
        # Not a product of matrices, for which BLAS may wake threads and wait for them.
        return [
            np.einsum('x,xk->k', weight, table.reshape(len(weight), -1)).reshape(table.shape[1:])
            for table in tables
        ]

    def _summed(self, which: int, where: list[Where]) -> FloatArray:
        """The same from single table states; which: 0 for the scale, 1 for stopping."""
        total: FloatArray | float = 0.0
        for states in product(*map(possible, where)):
            weight = float(np.prod([p for _, p in states]))
            total = total + weight * self._at(tuple(x for x, _ in states))[which]
        return np.asarray(total)

    def _at(self, where: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        """Scale and P(stop) of one table state; the latest are kept."""
        if where not in self._found:
            if len(self._found) >= self._kept:
                self._found.popitem(last=False)
            self._found[where] = self._computed(where)
        return self._found[where]

    def _computed(self, where: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        each = [(o, x, self._numbers[:, o]) for o, x in enumerate(where)]
        stop = np.exp(sum(self._leave[o][x].take(g, axis=0) for o, x, g in each))
        z = stop + sum(self._acts[o][x].take(g, axis=0) for o, x, g in each)
        e = self._giving_up
        return np.asarray((1 - e) / z), np.asarray(e + (1 - e) * stop / z)

    def _every(self) -> tuple[FloatArray, list[FloatArray]]:
        """P(stop), shape [x, ...], and the scale by object, shape [x_o, x of the others, ...]."""
        objects, states = len(self._act), self._states
        found = [self._computed(x) for x in product(range(states), repeat=objects)]
        scale, stop = (np.stack(tables) for tables in zip(*found, strict=True))
        split = scale.reshape((states,) * objects + scale.shape[1:])
        shape = states, states ** (objects - 1), *scale.shape[1:]
        return stop, [
            np.ascontiguousarray(np.moveaxis(split, o, 0)).reshape(shape) for o in range(objects)
        ]


def possible(where: Where) -> list[tuple[int, float]]:
    """The states that an object may be in, with their probabilities."""
    if isinstance(where, int):
        return [(where, 1.0)]
    return [(x, p) for x, p in enumerate(where.tolist()) if p > 0]
