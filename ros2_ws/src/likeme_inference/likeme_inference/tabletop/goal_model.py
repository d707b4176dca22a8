"""The goal-based graphical model as one value: all of Fig 3, for one demonstration or many.

Evidence on a state is either known or soft. Whole numbers are known states, of any shape; real
numbers are distributions over states along the last axis, as perception gives them. A distribution
enters as virtual evidence: a node that was seen with likelihood p(x), every x equally likely
before. Known and soft evidence broadcast against each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from likeme_inference.tabletop.goal_inference import (
    direct_policy,
    goal_likelihood,
    normalised,
    posterior_table,
    reach,
)
from likeme_inference.tabletop.policy import explored_policy
from likeme_inference.tabletop.transition_model import FloatArray


@dataclass(frozen=True, eq=False)
class GoalModel:
    """p(G) p(A | G, X_i) p(X_f | X_i, A) of one object, for the robot and whom it watches.

    For up to a few hundred states; more and sparse ones: SparseGoalModel.

    Attributes:
        transition: the robot's own p(X_f | X_i, A), shape [x_i, a, x_f].
        goals: which states fulfil which goal, 0 or 1, shape [g, x_f].
        policy: P(A | G, X_i), shape [x_i, g, a]; rows sum to 1, or to 0 where nothing reaches g.
        prior: P(G), shape [g].
        demonstrator: p(X_f | X_i, A) of the one who is watched; the robot's own is "like me".
        demonstrator_policy: what they do for a goal, shape [x_i, g, a].
    """

    transition: FloatArray
    goals: FloatArray
    policy: FloatArray
    prior: FloatArray
    demonstrator: FloatArray
    demonstrator_policy: FloatArray

    def __post_init__(self) -> None:
        states, actions = self.transition.shape[:2]
        goals = len(self.goals)
        shapes = {
            'transition': (states, actions, states),
            'goals': (goals, states),
            'policy': (states, goals, actions),
            'prior': (goals,),
            'demonstrator': (states, actions, states),
            'demonstrator_policy': (states, goals, actions),
        }
        for name, shape in shapes.items():
            # Numbers of its own, which no caller can change afterwards.
            table = np.array(getattr(self, name), dtype=np.float64)
            _check(name, table, shape)
            if name in ('transition', 'prior', 'demonstrator'):
                _check_sums(name, table)
            table.flags.writeable = False
            object.__setattr__(self, name, table)

    @classmethod
    def of(
        cls,
        transition: ArrayLike,
        goals: ArrayLike | None = None,
        prior: ArrayLike | None = None,
        demonstrator: ArrayLike | None = None,
        explored: bool = False,
    ) -> GoalModel:
        """Build the model on a learned transition (Fig 3c).

        Args:
            transition: shape [x_i, a, x_f].
            goals: shape [g, x_f]; None: each state is a goal.
            prior: P(G); None: uniform.
            demonstrator: what their actions do, by which they choose them, too; shape
                [x_i, a, x_f]. None: the robot's own transition and policy ("like me").
            explored: policies after goal-based exploration, instead of the direct ones.
        """
        own = np.asarray(transition, dtype=np.float64)
        other = own if demonstrator is None else np.asarray(demonstrator, dtype=np.float64)
        matrix = np.eye(own.shape[-1]) if goals is None else np.asarray(goals, dtype=np.float64)
        _check('goals', matrix, (len(matrix), own.shape[-1]))
        _check('demonstrator', other, own.shape)
        make = explored_policy if explored else direct_policy
        policy = make(own, goals=matrix)
        return cls(
            own,
            matrix,
            policy,
            np.full(len(matrix), 1.0 / len(matrix)) if prior is None else np.asarray(prior),
            other,
            policy if demonstrator is None else make(other, goals=matrix),
        )

    def predict(self, x_i: ArrayLike, a: ArrayLike) -> FloatArray:
        """P(X_f | x_i, A = a), shape [..., x_f] (Fig 3a, 3f, 8c)."""
        here, a = np.asarray(x_i), np.asarray(a)
        if _known(here):
            return np.asarray(self.transition[here, a])
        weights = normalised(here, 1.0 / here.shape[-1])
        rows = np.moveaxis(self.transition, 1, 0)[a]
        return np.asarray(np.einsum('...x,...xf->...f', weights, rows))

    def action_posterior(self, x_i: ArrayLike, x_f: ArrayLike) -> FloatArray:
        """P(A | x_i, x_f), actions equally likely before, shape [..., a] (Fig 3b).

        A change that no action can make leaves the actions equally likely.
        """
        actions = self.transition.shape[1]
        likelihood = _evidence(np.swapaxes(self.transition, 1, 2), x_i, x_f)
        return normalised(likelihood, 1.0 / actions)

    def goal_posterior(self, x_i: ArrayLike, x_f: ArrayLike) -> FloatArray:
        """P(G | x_i, x_f), actions summed out, shape [..., g] (Fig 3d, 8a).

        A change that no goal can explain leaves the prior.
        """
        if isinstance(x_i, int) and isinstance(x_f, int) and x_i >= 0 and x_f >= 0:
            # One demonstration, as it comes while the robot watches.
            return np.asarray(self._posterior[x_i, x_f])
        if _known(here := np.asarray(x_i)) and _known(there := np.asarray(x_f)):
            return _looked_up(self._posterior, here, there)
        return normalised(self.prior * _evidence(self._likelihood, x_i, x_f), self.prior)

    def action_for(self, x_i: ArrayLike, g: ArrayLike) -> FloatArray:
        """P(A | x_i, G = g), shape [..., a]; all zero where no action reaches g (Fig 3e, 8b)."""
        here, g = np.asarray(x_i), np.asarray(g)
        if _known(here):
            return np.asarray(self.policy[here, g])
        mixed = np.einsum('...x,...xa->...a', here, np.moveaxis(self.policy, 1, 0)[g])
        return normalised(mixed, 0.0)

    def success(self, x_i: int, g: int) -> FloatArray:
        """P(X_f fulfils g | x_i, A) of every action, shape [a]."""
        return np.asarray(self._reach[x_i, g])

    @cached_property
    def _reach(self) -> FloatArray:
        return reach(self.transition, self.goals)

    @cached_property
    def _likelihood(self) -> FloatArray:
        """P(X_f | X_i, G), shape [x_i, x_f, g]."""
        return goal_likelihood(self.demonstrator, self.demonstrator_policy)

    @cached_property
    def _posterior(self) -> FloatArray:
        """P(G | x_i, x_f) of every change, shape [x_i, x_f, g]: a look-up answers a query."""
        posterior = posterior_table(self.demonstrator, self.demonstrator_policy, self.prior)
        posterior.flags.writeable = False
        return posterior


def _known(evidence: NDArray[Any]) -> bool:
    return evidence.dtype.kind in 'iu'


def _looked_up(table: FloatArray, here: NDArray[Any], there: NDArray[Any]) -> FloatArray:
    """table[x_i, x_f]; a negative number is no state, though NumPy would count from the end."""
    for states in (here, there):
        least = int(states.min(initial=0) if states.ndim else states)
        if least < 0:
            raise ValueError(f'Expected states from 0 to {len(table) - 1}, got {least}.')
    return np.asarray(table[here, there])


def _evidence(table: FloatArray, x_i: ArrayLike, x_f: ArrayLike) -> FloatArray:
    """Sum table[x_i, x_f, k] over both states, weighted by the evidence; shape [..., k]."""
    here, there = np.asarray(x_i), np.asarray(x_f)
    if _known(here) and _known(there):
        return _looked_up(table, here, there)
    states = len(table)
    for evidence in (here, there):
        _check_evidence(evidence, states)
    if _known(here):
        return np.asarray(np.einsum('...f,...fk->...k', there, table[here]))
    if _known(there):
        rows = np.swapaxes(table, 0, 1)[there]
        return np.asarray(np.einsum('...x,...xk->...k', here, rows))
    joint = here[..., :, None] * there[..., None, :]
    flat = joint.reshape(*joint.shape[:-2], states * states)
    return np.asarray(flat @ table.reshape(states * states, -1))


def _check_evidence(evidence: NDArray[Any], states: int) -> None:
    if _known(evidence):
        return
    if evidence.shape[-1:] != (states,):
        raise ValueError(
            f'Expected distributions over {states} states, got shape {evidence.shape}.'
        )
    if not (evidence >= 0).all():
        raise ValueError(f'Expected probabilities of 0 or more, got {evidence.min()}.')


def _check(what: str, array: FloatArray, shape: tuple[int, ...]) -> None:
    """Refuse what is no table of probabilities of this shape."""
    if array.shape != shape:
        raise ValueError(f'Expected {what} of shape {shape}, got {array.shape}.')
    if not np.isfinite(array).all() or array.min() < 0:
        raise ValueError(f'Expected {what} of 0 or more, got {array.min()}.')


def _check_sums(what: str, array: FloatArray) -> None:
    off = np.abs(array.sum(axis=-1) - 1.0)
    if off.max() > 1e-6:
        worst = array.sum(axis=-1).flat[off.argmax()]
        raise ValueError(f'Expected {what} to sum to 1, got {worst:g}.')
