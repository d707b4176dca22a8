"""Draws of what is known after the trials: p(X_f | X_i, A), goals, and counts made again.

    p ~ Dirichlet(alpha + n), goal = P(G | x_i, x_f) under p, counts ~ Multinomial(trials, p)

for every object, row and change of state; and the same from the prior Dirichlet(alpha). Draws are
independent: chains are there because programs for Markov chains expect them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from likeme_inference.tabletop.arrays import FloatArray, IntArray
from likeme_inference.tabletop.dirichlet import CONCENTRATION, sample_transitions
from likeme_inference.tabletop.domain import Policy
from likeme_inference.tabletop.evidence import evidence, known
from likeme_inference.tabletop.goal_exploration import explored_policy
from likeme_inference.tabletop.goal_inference import (
    direct_policy,
    goal_likelihood,
    normalised,
    posterior_table,
)
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.transition_model import TransitionModel


class Draws(NamedTuple):
    """Independent draws from the posterior or the prior.

    Attributes:
        transition: p(X_f | X_i, A), shape [chain, draw, object, x_i, action, x_f].
        goal_probability: P(G | x_i, x_f) of every change that may be shown, with known states;
            shape [chain, draw, object, x_i, x_f, goal].
        counts: as many trials of each row as were made, made again; shape as of transition.
    """

    transition: FloatArray
    goal_probability: FloatArray
    counts: IntArray


@dataclass(frozen=True, eq=False)
class PosteriorDraws:
    """Draws of a robot's model with their names and the data they follow from.

    Attributes:
        model: name and version of the robot's model.
        objects, states, actions, goals: names, in the order of the axes.
        goal_states: which states fulfil which goal, 0 or 1, shape [goal, x_f].
        observed: trials, shape [object, x_i, action, x_f].
        pseudo_counts: Dirichlet pseudo-counts of the prior, same shape.
        goal_prior: P(G), shape [goal].
        policy: which of the paper's two variants the goals follow from.
        posterior, prior: the draws.
    """

    model: str
    objects: tuple[str, ...]
    states: tuple[str, ...]
    actions: tuple[str, ...]
    goals: tuple[str, ...]
    goal_states: FloatArray
    observed: IntArray
    pseudo_counts: FloatArray
    goal_prior: FloatArray
    policy: Policy
    posterior: Draws
    prior: Draws

    def demonstration(self, name: str, x_i: ArrayLike, x_f: ArrayLike) -> FloatArray:
        """Posterior draws of P(G | x_i, x_f) of one demonstration, shape [chain, draw, goal].

        Args:
            name: of the object.
            x_i: a known state, or a distribution over states (evidence.py).
            x_f: likewise.

        Raises:
            ValueError: an unknown object, or evidence on more than one demonstration.
        """
        if name not in self.objects:
            raise ValueError(f'Expected one of the objects {list(self.objects)}, got {name!r}.')
        o, states = self.objects.index(name), len(self.states)
        here, there = evidence('x_i', x_i, states), evidence('x_f', x_f, states)
        if known(here) and known(there) and here.ndim == there.ndim == 0:
            return np.asarray(self.posterior.goal_probability[:, :, o, here, there])
        seen = [np.eye(states)[each] if known(each) else each for each in (here, there)]
        if any(each.ndim != 1 for each in seen):
            raise ValueError('Expected one demonstration, got several.')
        transition = self.posterior.transition[:, :, o]
        likelihood = goal_likelihood(
            transition, _policy(transition, self.goal_states, self.policy)
        )
        weighed = np.einsum('i,f,...ifg->...g', *seen, likelihood)
        return normalised(self.goal_prior * weighed, self.goal_prior)


def posterior_draws(
    model: RobotModel,
    rng: np.random.Generator,
    draws: int = 1000,
    chains: int = 4,
    *,
    concentration: float = CONCENTRATION,
    prior: Prior = Prior.OWN,
    goal_prior: Sequence[float] | None = None,
    policy: Policy = Policy.DIRECT,
) -> PosteriorDraws:
    """Draw `chains` times `draws` models from the posterior of a robot's trials, and the prior.

    Args:
        model: the robot's trials.
        rng: of all draws.
        draws: of each chain.
        chains: number of groups of draws.
        concentration: pseudo-count of every final state with Prior.OWN. The paper's maximum
            likelihood, 0, has no posterior.
        prior: OWN, or one that was fitted to all objects' trials, which then enter twice.
        goal_prior: P(G), shape [goal]; None: uniform.
        policy: which of the paper's two variants.

    Raises:
        ValueError: no object, draw or chain; a prior that is not proper, or of goals that does
            not fit.
    """
    if min(draws, chains) < 1 or not model.objects:
        raise ValueError(
            f'Expected objects, draws and chains, got {len(model.objects)}, {draws}, {chains}.'
        )
    domain = model.domain
    learned = [model.counted(name, concentration, prior) for name in model.objects]
    pseudo_counts = np.array([each.pseudo_counts - each.counts for each in learned])
    if not (pseudo_counts > 0).all():
        raise ValueError(
            f'Expected a concentration above 0, got {concentration:g}: maximum likelihood has no '
            'posterior.'
        )
    observed = np.array([each.counts for each in learned])
    goals = len(domain.goal_matrix)
    uniform = np.full(goals, 1.0 / goals)
    beliefs = uniform if goal_prior is None else np.asarray(goal_prior, dtype=np.float64)
    if beliefs.shape != (goals,) or not np.isclose(beliefs.sum(), 1) or (beliefs < 0).any():
        raise ValueError(f'Expected {goals} probabilities that sum to 1, got {beliefs.tolist()}.')
    untried = [TransitionModel(np.zeros_like(each.counts), each.prior) for each in learned]
    drawn = [
        _draws(each, observed, domain.goal_matrix, beliefs, policy, rng, (chains, draws))
        for each in (learned, untried)
    ]
    return PosteriorDraws(
        model=model.label,
        objects=tuple(model.objects),
        states=domain.states,
        actions=domain.actions,
        goals=tuple(domain.goals),
        goal_states=np.asarray(domain.goal_matrix),
        observed=observed,
        pseudo_counts=pseudo_counts,
        goal_prior=beliefs,
        policy=Policy(policy),
        posterior=drawn[0],
        prior=drawn[1],
    )


def _draws(
    learned: Sequence[TransitionModel],
    observed: IntArray,
    goal_states: FloatArray,
    goal_prior: FloatArray,
    policy: Policy,
    rng: np.random.Generator,
    size: tuple[int, int],
) -> Draws:
    each = [sample_transitions(known, rng, size[0] * size[1]) for known in learned]
    transition = np.stack(each, axis=1).reshape(*size, len(each), *each[0].shape[1:])
    chosen = _policy(transition, goal_states, policy)
    return Draws(
        transition,
        posterior_table(transition, chosen, goal_prior),
        rng.multinomial(observed.sum(axis=-1), transition),
    )


def _policy(transition: FloatArray, goal_states: FloatArray, policy: Policy) -> FloatArray:
    if Policy(policy) is Policy.DIRECT:
        return direct_policy(transition, goal_states)
    return explored_policy(transition, goals=goal_states)


#: Names of the fields of PosteriorDraws that are draws; the others are arrays, names or words.
DRAWN = ('posterior', 'prior')
NAMES = ('objects', 'states', 'actions', 'goals')
ARRAYS = ('goal_states', 'observed', 'pseudo_counts', 'goal_prior')
assert {*DRAWN, *NAMES, *ARRAYS, 'model', 'policy'} == {f.name for f in fields(PosteriorDraws)}
