"""The goal-based graphical model of Fig 3, for single demonstrations and batches.

Evidence on a state is known or soft, and may be a batch: see evidence.py.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop import planning
from likeme_inference.tabletop.arrays import BoolArray, FloatArray
from likeme_inference.tabletop.bounded_cache import BoundedCache
from likeme_inference.tabletop.checks import number, numbers, sums_to_one, table
from likeme_inference.tabletop.domain import Policy
from likeme_inference.tabletop.evidence import evidence, known, weighed
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.goal_exploration import explored_policy
from likeme_inference.tabletop.goal_inference import (
    direct_policy,
    goal_likelihood,
    normalised,
    posterior_table,
    reach,
)
from likeme_inference.tabletop.planning import Plan
from likeme_inference.tabletop.transition_model import TransitionModel

#: Answers that are kept of one model: all of a table's, and of larger worlds the latest.
ANSWERS_KEPT = 4096
#: The arrays of a GoalModel, by name.
TABLES = ('transition', 'goals', 'policy', 'prior', 'demonstrator', 'demonstrator_policy')


class Estimated(NamedTuple):
    """The Dirichlet posterior of p(X_f | X_i, A), and the policy that follows from each draw.

    Attributes:
        pseudo_counts: its parameters, shape [x_i, a, x_f].
    """

    pseudo_counts: FloatArray
    policy: Policy


@dataclass(frozen=True, eq=False)
class GoalModel:
    """p(G) p(A | G, X_i) p(X_f | X_i, A) of one object, for the robot and a demonstrator.

    For up to a few hundred states; SparseGoalModel is for more.

    Attributes:
        transition: the robot's own p(X_f | X_i, A), shape [x_i, a, x_f].
        goals: which states fulfil which goal, 0 or 1, shape [g, x_f].
        policy: P(A | G, X_i), shape [x_i, g, a]; rows sum to 1, or to 0 where nothing reaches g.
        prior: P(G), shape [g].
        demonstrator: p(X_f | X_i, A) of the demonstrator, shape [x_i, a', x_f]; the actions a' may
            differ from the robot's. "Like me" is the robot's own.
        demonstrator_policy: P(A | G, X_i) of the demonstrator, shape [x_i, g, a'].
        domain: names, ties and states out of reach; None: no names, and no state is out of reach.
        possible: which actions can be taken at present, shape [x_i, a]; None: all of them.
        estimated: what the rows of `transition`, and of the demonstrator with them, are estimated
            from; None: they are certain.
    """

    transition: FloatArray
    goals: FloatArray
    policy: FloatArray
    prior: FloatArray
    demonstrator: FloatArray
    demonstrator_policy: FloatArray
    domain: Domain | None = None
    possible: BoolArray | None = None
    estimated: Estimated | None = None

    def __post_init__(self) -> None:
        for name in TABLES:
            # Copies, so that callers cannot change the model.
            own = np.array(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, _read_only(own))
        for name, shape in self._shapes().items():
            table(name, getattr(self, name), shape)
        if self.domain is not None and self.domain.shape != self.transition.shape:
            raise ValueError(
                f'Expected transition of shape {self.domain.shape}, as the domain has it, '
                f'got {self.transition.shape}.'
            )
        for name in ('transition', 'prior', 'demonstrator'):
            sums_to_one(name, getattr(self, name))
        if not np.isin(self.goals, (0.0, 1.0)).all():
            raise ValueError(f'Expected goals of 0 or 1, got {self.goals.tolist()}.')

    def _shapes(self) -> dict[str, tuple[int, ...]]:
        states, actions = self.transition.shape[:2]
        goals, theirs = len(self.goals), self.demonstrator.shape[1]
        return {
            'transition': (states, actions, states),
            'goals': (goals, states),
            'policy': (states, goals, actions),
            'prior': (goals,),
            'demonstrator': (states, theirs, states),
            'demonstrator_policy': (states, goals, theirs),
        }

    @classmethod
    def of(
        cls,
        transition: ArrayLike | TransitionModel,
        goals: ArrayLike | Domain | None = None,
        prior: ArrayLike | None = None,
        demonstrator: ArrayLike | TransitionModel | None = None,
        policy: Policy = Policy.DIRECT,
    ) -> GoalModel:
        """Build the model from a learned transition model (Fig 3c).

        Args:
            transition: shape [x_i, a, x_f], or a TransitionModel.
            goals: the domain of the goals; or an array of shape [g, x_f]; None: each state is a
                goal.
            prior: P(G); None: uniform.
            demonstrator: transition of the demonstrator, from which its policy follows; shape
                [x_i, a', x_f]. None: the robot's own ("like me").
            policy: which of the paper's two variants.

        Raises:
            ValueError: arrays that do not match, or are not probabilities.
        """
        own = _transition('transition', transition)
        other = own if demonstrator is None else _transition('demonstrator', demonstrator)
        domain = goals if isinstance(goals, Domain) else None
        given = np.eye(len(own)) if goals is None else goals
        matrix = np.asarray(given if domain is None else domain.goal_matrix, dtype=np.float64)
        table('goals', matrix, (len(matrix), len(own)))
        if len(other) != len(own):
            raise ValueError(f'Expected a demonstrator of {len(own)} states, got {len(other)}.')
        chosen = policy_of(own, matrix, policy)
        # Relative frequencies are taken as certain, and another demonstrator as known.
        estimated = None
        if isinstance(transition, TransitionModel) and demonstrator is None:
            alpha = transition.pseudo_counts
            if np.any(transition.prior) and alpha.any(axis=-1).all():
                estimated = Estimated(alpha, Policy(policy))
        return cls(
            own,
            matrix,
            chosen,
            np.full(len(matrix), 1.0 / len(matrix)) if prior is None else np.asarray(prior),
            other,
            chosen if demonstrator is None else policy_of(other, matrix, policy),
            domain,
            estimated=estimated,
        )

    def without(self, x_i: int, actions: Collection[int]) -> GoalModel:
        """The model in which these actions cannot be taken from x_i: they leave an object there.

        What is known of the demonstrator stays, and with it every goal posterior.
        """
        x_i, blocked = number('x_i', x_i, len(self.transition)), list(actions)
        transition, policy = self.transition.copy(), self.policy.copy()
        transition[x_i, blocked] = np.eye(len(transition))[x_i]
        policy[x_i, :, blocked] = 0.0
        possible = np.ones(transition.shape[:2], dtype=bool)
        possible[x_i, blocked] = False
        return replace(
            self, transition=transition, policy=normalised(policy, 0.0), possible=possible
        )

    @property
    def stuck(self) -> BoolArray:
        """Which states are out of reach, shape [x]."""
        nowhere = np.zeros(len(self.transition), dtype=bool)
        return nowhere if self.domain is None else self.domain.stuck

    def aimed(self, g: int) -> tuple[int, ...]:
        """Actions aimed at a goal, which are preferred among equals."""
        return () if self.domain is None else self.domain.aimed[g]

    def predict(self, x_i: ArrayLike, a: ArrayLike) -> FloatArray:
        """P(X_f | x_i, A = a), shape [..., x_f] (Fig 3a, 3f, 8c)."""
        states, actions, _ = self.transition.shape
        here, a = evidence('x_i', x_i, states), numbers('a', a, actions)
        if known(here):
            return np.asarray(self.transition[here, a])
        weights = normalised(here, 1.0 / states)
        rows = np.moveaxis(self.transition, 1, 0)[a]
        return np.asarray(np.einsum('...x,...xf->...f', weights, rows))

    def action_posterior(self, x_i: ArrayLike, x_f: ArrayLike) -> FloatArray:
        """P(A | x_i, x_f) under a uniform prior of A, shape [..., a] (Fig 3b).

        By the robot's own transition. Uniform for a change that no action makes.
        """
        states, actions, _ = self.transition.shape
        here, there = evidence('x_i', x_i, states), evidence('x_f', x_f, states)
        likelihood = weighed(np.swapaxes(self.transition, 1, 2), here, there)
        return normalised(likelihood, 1.0 / actions)

    def goal_posterior(self, x_i: ArrayLike, x_f: ArrayLike) -> FloatArray:
        """P(G | x_i, x_f), actions summed out, shape [..., g] (Fig 3d, 8a).

        Integers are known states, [0, 1, 0] three of them; floats are distributions. A change that
        no goal explains leaves the prior.
        """
        states = len(self.transition)
        if isinstance(x_i, int) and isinstance(x_f, int):
            # Fast path for a single demonstration.
            at = number('x_i', x_i, states), number('x_f', x_f, states)
            return np.asarray(self._posterior[at])
        here, there = evidence('x_i', x_i, states), evidence('x_f', x_f, states)
        if known(here) and known(there):
            return np.asarray(self._posterior[here, there])
        return normalised(self.prior * weighed(self._likelihood, here, there), self.prior)

    def action_for(self, x_i: ArrayLike, g: ArrayLike) -> FloatArray:
        """P(A | x_i, G = g), shape [..., a]; all zero where no action reaches g (Fig 3e, 8b)."""
        here, g = evidence('x_i', x_i, len(self.transition)), numbers('g', g, len(self.goals))
        if known(here):
            return np.asarray(self.policy[here, g])
        mixed = np.einsum('...x,...xa->...a', here, np.moveaxis(self.policy, 1, 0)[g])
        return normalised(mixed, 0.0)

    def success(self, x_i: int, g: int) -> FloatArray:
        """P(X_f fulfils g | x_i, A) of every action, shape [a], read-only."""
        at = number('x_i', x_i, len(self.transition)), number('g', g, len(self.goals))
        return np.asarray(self._reach[at])

    def plan(self, g: int, actions_left: int) -> Plan:
        """The best plan for a goal; the domain decides ties and reach."""
        goal = self.goals[number('g', g, len(self.goals))] > 0
        prefer = self.aimed(g)
        return planning.plan(
            self.transition, goal, actions_left, self.stuck, prefer, self.possible
        )

    @cached_property
    def answers(self) -> BoundedCache[Any]:
        """What other modules have worked out from this model, by what it is and its arguments."""
        return BoundedCache(ANSWERS_KEPT)

    @cached_property
    def _reach(self) -> FloatArray:
        return _read_only(reach(self.transition, self.goals))

    @cached_property
    def _likelihood(self) -> FloatArray:
        """P(X_f | X_i, G), shape [x_i, x_f, g]."""
        return goal_likelihood(self.demonstrator, self.demonstrator_policy)

    @cached_property
    def _posterior(self) -> FloatArray:
        """P(G | x_i, x_f) of every change, shape [x_i, x_f, g]."""
        return _read_only(posterior_table(self.demonstrator, self.demonstrator_policy, self.prior))


def policy_of(transition: FloatArray, goals: FloatArray, policy: Policy) -> FloatArray:
    """The variant `policy` of P(A | G, X_i) for transition[..., x_i, a, x_f] and goals[g, x_f]."""
    make = direct_policy if Policy(policy) is Policy.DIRECT else explored_policy
    return make(transition, goals=goals)


def _transition(what: str, given: ArrayLike | TransitionModel) -> FloatArray:
    learned = given.transition if isinstance(given, TransitionModel) else given
    own = np.asarray(learned, dtype=np.float64)
    if own.ndim != 3:
        raise ValueError(f'Expected {what} of shape [x_i, a, x_f], got {own.shape}.')
    table(what, own, (len(own), own.shape[1], len(own)))
    sums_to_one(what, own)
    return own


def _read_only(array: FloatArray) -> FloatArray:
    array.flags.writeable = False
    return array
