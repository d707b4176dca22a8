"""The Dirichlet posterior of each row of p(X_f | X_i, A): intervals, samples, priors.

With prior pseudo-counts alpha and counts n the posterior of a row is Dirichlet(alpha + n); each
of its probabilities has the marginal Beta(alpha_f + n_f, rest).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.transition_model import TransitionModel, maximum_likelihood

#: Default pseudo-count of every final state. Maximises the leave-one-out likelihood of the 360
#: real trials from states within reach: -189.0 nats (0.01: -194.3, 1: -213.4;
#: `aimed_prior`: -184.8).
CONCENTRATION = 0.09
#: Pseudo-counts of `aimed_prior` that maximise the same likelihood.
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
    """Pseudo-counts for actions that reach their target state or leave the object where it is.

    Args:
        states: number of states.
        aims: target state of each action, shape [a].
        stay: pseudo-count of the initial state.
        aimed: pseudo-count of the target state, if different.
        elsewhere: pseudo-count of every other state.

    Returns:
        Shape [x_i, a, x_f], for TransitionModel.prior.
    """
    prior = np.full((states, len(aims), states), elsewhere)
    prior[:, np.arange(len(aims)), list(aims)] = aimed
    # If the target is the initial state, only `stay` applies.
    prior[np.arange(states), :, np.arange(states)] = stay
    return prior


def credible_interval(model: TransitionModel, level: float = 0.95) -> CredibleInterval:
    """Equal-tailed marginal credible bounds of every p(x_f | x_i, a).

    CONCENTRATION is used for a model without a prior, whose posterior would be certain after one
    trial.

    Raises:
        ValueError: a level outside 0 to 1.
    """
    if not 0 < level < 1:
        raise ValueError(f'Expected a level between 0 and 1, got {level:g}.')
    model = model if np.any(model.prior) else TransitionModel(model.counts, CONCENTRATION)
    ours = _proper_pseudo_counts(model)
    rest = ours.sum(axis=-1, keepdims=True) - ours
    tail = (1 - level) / 2
    # Here, as it takes a node a third of its start, and nodes need no intervals.
    from scipy import special

    # A final state without pseudo-count and trial has probability 0, one with all of them 1.
    sure = (ours > 0).astype(np.float64)
    open_ = (ours > 0) & (rest > 0)
    a, b = np.where(open_, ours, 1.0), np.where(open_, rest, 1.0)
    low = np.where(open_, special.betaincinv(a, b, tail), sure)
    high = np.where(open_, special.betaincinv(a, b, 1 - tail), sure)
    return CredibleInterval(low, high)


def leave_one_out(model: TransitionModel) -> float:
    """Log-likelihood (nats) of every trial under the posterior mean of all the others.

    log p(trial) = log((n_f - 1 + alpha_f) / (N - 1 + sum of alpha)), summed over trials. The
    criterion of CONCENTRATION; -inf for maximum likelihood if any result occurred once.
    """
    n = model.counts
    alpha = np.broadcast_to(np.asarray(model.prior, dtype=np.float64), n.shape)
    others = n - 1 + alpha
    rest = n.sum(axis=-1, keepdims=True) - 1 + alpha.sum(axis=-1, keepdims=True)
    with np.errstate(divide='ignore', invalid='ignore'):
        # Probability 0 without pseudo-counts and other trials, also where both sums are 0.
        gain = np.where(others > 0, np.log(others) - np.log(rest), -np.inf)
        gain = np.where(n > 0, n * gain, 0.0)
    return float(gain.sum())


def sample_transitions(
    model: TransitionModel, rng: np.random.Generator, samples: int
) -> FloatArray:
    """Sample transition models from the posterior; shape [sample, x_i, a, x_f].

    A row with neither trials nor prior is sampled uniformly from all distributions.
    """
    return sample_rows(_proper_pseudo_counts(model), rng, samples)


def sample_rows(alpha: FloatArray, rng: np.random.Generator, samples: int) -> FloatArray:
    """Samples of Dirichlet distributions with parameters alpha[..., x_f]; [sample, ..., x_f]."""
    gamma = rng.standard_gamma(alpha, size=(samples, *alpha.shape))
    lost = gamma.sum(axis=-1) == 0
    if lost.any():
        # Tiny pseudo-counts underflow. The limit of the Dirichlet puts all probability on one
        # final state, drawn in proportion to the pseudo-counts.
        cumulative = maximum_likelihood(np.broadcast_to(alpha, gamma.shape)[lost]).cumsum(axis=-1)
        drawn = (
            (rng.random((len(cumulative), 1)) >= cumulative)
            .sum(axis=-1)
            .clip(max=alpha.shape[-1] - 1)
        )
        gamma[lost] = np.eye(alpha.shape[-1])[drawn]
    return np.asarray(gamma / gamma.sum(axis=-1, keepdims=True))


def _proper_pseudo_counts(model: TransitionModel) -> FloatArray:
    """Pseudo-counts, with 1 for every final state in rows with neither trials nor prior."""
    ours = model.pseudo_counts
    return np.where(ours.sum(axis=-1, keepdims=True) > 0, ours, 1.0)
