"""How sure a transition model may be: the Dirichlet posterior of each row of p(X_f | X_i, A).

With prior pseudo-counts alpha and counts n the posterior of a row is Dirichlet(alpha + n); each
of its probabilities alone is Beta(alpha_f + n_f, rest).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.transition_model import TransitionModel, maximum_likelihood

#: Pseudo-count of every final state by default, where a prior is wanted. Chosen by leave-one-out
#: likelihood on the 360 real trials from LEFT and RIGHT: greatest at 0.09 (-189.0 nats; 0.01:
#: -194.3, 1: -213.4; one for stay, target and elsewhere each, -184.8, see `aimed_prior`).
CONCENTRATION = 0.09
#: The best of that family on the same trials: `aimed_prior`'s pseudo-counts.
STAY, AIMED, ELSEWHERE = 0.8, 1.35, 0.05


class CredibleInterval(NamedTuple):
    """Credible bounds of p(X_f | X_i, A), each of shape [x_i, a, x_f]."""

    low: FloatArray
    high: FloatArray


def aimed_prior(
    states: int,
    aims: tuple[int, ...],
    stay: float = STAY,
    aimed: float = AIMED,
    elsewhere: float = ELSEWHERE,
) -> FloatArray:
    """Pseudo-counts of one who knows what actions are for: they do it, or nothing moves.

    Args:
        states: how many there are.
        aims: the state each action is meant for, shape [a].
        stay: pseudo-count of the state the object is in.
        aimed: pseudo-count of the state aimed at, where that is another.
        elsewhere: pseudo-count of every other state.

    Returns:
        Shape [x_i, a, x_f], for TransitionModel.prior.
    """
    prior = np.full((states, len(aims), states), elsewhere)
    prior[:, np.arange(len(aims)), list(aims)] = aimed
    # An action that aims at where the object is already has one way to succeed, not two.
    prior[np.arange(states), :, np.arange(states)] = stay
    return prior


def credible_interval(model: TransitionModel, level: float = 0.95) -> CredibleInterval:
    """Equal-tailed credible bounds of every p(x_f | x_i, a) by itself.

    A model without a prior gets CONCENTRATION for this: maximum likelihood alone would be certain
    after one trial.

    Raises:
        ValueError: for a level that is no probability.
    """
    if not 0 < level < 1:
        raise ValueError(f'Expected a level between 0 and 1, got {level:g}.')
    model = model if np.any(model.prior) else TransitionModel(model.counts, CONCENTRATION)
    ours = _open(model)
    rest = ours.sum(axis=-1, keepdims=True) - ours
    tail = (1 - level) / 2
    # A final state with no pseudo-count and no trial is impossible, one with all of them certain.
    sure = (ours > 0).astype(np.float64)
    open_ = (ours > 0) & (rest > 0)
    a, b = np.where(open_, ours, 1.0), np.where(open_, rest, 1.0)
    low = np.where(open_, special.betaincinv(a, b, tail), sure)
    high = np.where(open_, special.betaincinv(a, b, 1 - tail), sure)
    return CredibleInterval(low, high)


def leave_one_out(model: TransitionModel) -> float:
    """Log-likelihood (nats) of every trial under the posterior mean of all the others.

    log p(trial) = log((n_f - 1 + alpha_f) / (N - 1 + sum of alpha)), summed over trials. This is
    what CONCENTRATION was chosen by. -inf for maximum likelihood as soon as one result came once.
    """
    n = model.counts
    alpha = np.broadcast_to(np.asarray(model.prior, dtype=np.float64), n.shape)
    others = n - 1 + alpha
    rest = n.sum(axis=-1, keepdims=True) - 1 + alpha.sum(axis=-1, keepdims=True)
    with np.errstate(divide='ignore', invalid='ignore'):
        # What was never seen nor thought possible before is impossible, be it of nothing.
        gain = np.where(others > 0, np.log(others) - np.log(rest), -np.inf)
        gain = np.where(n > 0, n * gain, 0.0)
    return float(gain.sum())


def sample_transitions(
    model: TransitionModel, rng: np.random.Generator, samples: int
) -> FloatArray:
    """Draw transition models from the posterior; shape [sample, x_i, a, x_f].

    A row with neither trials nor prior is drawn uniformly from all distributions.
    """
    alpha = _open(model)
    gamma = rng.standard_gamma(alpha, size=(samples, *alpha.shape))
    lost = gamma.sum(axis=-1) == 0
    if lost.any():
        # Tiny pseudo-counts underflow; such a row is all but certain of one final state, each as
        # probable as its share of them.
        ladder = maximum_likelihood(np.broadcast_to(alpha, gamma.shape)[lost]).cumsum(axis=-1)
        drawn = (rng.random((len(ladder), 1)) >= ladder).sum(axis=-1).clip(max=alpha.shape[-1] - 1)
        gamma[lost] = np.eye(alpha.shape[-1])[drawn]
    return np.asarray(gamma / gamma.sum(axis=-1, keepdims=True))


def _open(model: TransitionModel) -> FloatArray:
    """Pseudo-counts; 1 each in rows with neither trials nor prior, which may be anything."""
    ours = model.pseudo_counts
    return np.where(ours.sum(axis=-1, keepdims=True) > 0, ours, 1.0)
