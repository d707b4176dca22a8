"""Goal inference on large sparse models: memory is proportional to the non-zeros.

A row of p(X_f | X_i, A) is stored as its observed final states plus one value for all others:

    p(x_f | x_i, a) = trial[(x_i, a), x_f] + background[(x_i, a)],

for maximum likelihood (background 0, or 1/n for a row without trials) and for symmetric Dirichlet
priors. Goals are states; the prior of actions is uniform.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.checks import number, sums_to_one, table
from likeme_inference.tabletop.goal_inference import normalised

if TYPE_CHECKING:
    from scipy import sparse


@dataclass(frozen=True, eq=False)
class SparseGoalModel:
    """A GoalModel for many states, with the direct policy and one goal per state.

    Attributes:
        trial: a CSR matrix of shape [x_i * a, x_f].
        background: added to every final state of a row, shape [x_i * a].
        actions: their number.
    """

    trial: sparse.csr_array
    background: FloatArray
    actions: int

    @classmethod
    def of_counts(
        cls, counts: sparse.csr_array, actions: int, prior: float = 0.0
    ) -> SparseGoalModel:
        """Learn from sparse counts of shape [x_i * actions + a, x_f].

        Raises:
            ValueError: a wrong shape, negative counts, or a negative prior.
        """
        rows, states = counts.shape
        if rows != states * actions:
            raise ValueError(f'Expected {states * actions} rows, got {rows}.')
        table(
            'counts and prior', np.append(counts.data, prior).astype(np.float64), (counts.nnz + 1,)
        )
        total = np.asarray(counts.sum(axis=1), dtype=np.float64) + prior * states
        known = total > 0
        scale = np.divide(1.0, total, out=np.zeros_like(total), where=known)
        background = np.where(known, prior * scale, 1.0 / states)
        # Here, as this module is imported with all of `tabletop`.
        from scipy import sparse

        trial = sparse.csr_array(counts, dtype=np.float64, copy=True)
        trial.data *= np.repeat(scale, np.diff(trial.indptr))
        return cls(trial, background, actions)

    @property
    def states(self) -> int:
        """Number of states and of goals."""
        return int(self.trial.shape[1])

    def predict(self, x_i: int, a: int) -> FloatArray:
        """P(X_f | x_i, A = a), shape [x_f]."""
        a = number('a', a, self.actions)
        rows, background = self._rows(x_i), self._background(x_i)
        return np.asarray(rows[[a]].toarray()[0] + background[a])

    def success(self, x_i: int, x_f: int) -> FloatArray:
        """P(x_f | x_i, A) of every action, shape [a]."""
        x_f = number('x_f', x_f, self.states)
        column = self._rows(x_i)[:, [x_f]].toarray()[:, 0]
        return np.asarray(column + self._background(x_i))

    def action_posterior(self, x_i: int, x_f: int) -> FloatArray:
        """P(A | x_i, x_f), the direct policy for the goal x_f; shape [a]."""
        return normalised(self.success(x_i, x_f), 1.0 / self.actions)

    def goal_posterior(self, x_i: int, x_f: int, prior: ArrayLike | None = None) -> FloatArray:
        """P(G | x_i, x_f), actions summed out, shape [g].

        P(x_f | x_i, g) = sum over a of p(g|x_i,a) p(x_f|x_i,a) / sum over a of p(g|x_i,a): two
        products of a vector with the rows of x_i, without a table of goals by actions.
        """
        rows, background = self._rows(x_i), self._background(x_i)
        reached = self.success(x_i, x_f)
        joint = rows.T @ reached + background @ reached
        total = rows.T @ np.ones(self.actions) + background.sum()
        likelihood = np.divide(joint, total, out=np.zeros_like(joint), where=total > 0)
        p_goal = np.full(self.states, 1 / self.states)
        if prior is not None:
            p_goal = np.asarray(prior, dtype=np.float64)
            table('prior', p_goal, (self.states,))
            sums_to_one('prior', p_goal)
        return normalised(p_goal * likelihood, p_goal)

    def value(self, goal: int, actions_left: int) -> FloatArray:
        """V_k of planning.plan for one goal, shape [actions_left + 1, x]."""
        goal = number('goal', goal, self.states)
        value = np.zeros((actions_left + 1, self.states))
        value[:, goal] = 1.0
        for k in range(1, actions_left + 1):
            quality = self.trial @ value[k - 1] + self.background * value[k - 1].sum()
            value[k] = quality.reshape(self.states, self.actions).max(axis=1)
            value[k, goal] = 1.0
        return value

    def _rows(self, x_i: int) -> sparse.csr_array:
        """trial of one initial state, shape [a, x_f]."""
        begin = number('x_i', x_i, self.states) * self.actions
        return self.trial[begin : begin + self.actions]

    def _background(self, x_i: int) -> FloatArray:
        begin = x_i * self.actions
        return self.background[begin : begin + self.actions]
