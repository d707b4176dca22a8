"""Help rate against number of trials, by exploration policy (future work of the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from likeme_core.progress_bar import counted
from likeme_inference.tabletop.active_exploration import help_rate, information_gain
from likeme_inference.tabletop.arrays import FloatArray, IntArray
from likeme_inference.tabletop.dirichlet import CONCENTRATION
from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.finite_domain import Domain
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.shared_prior import START, fit_weights, shared_prior
from likeme_inference.tabletop.transition_model import maximum_likelihood

#: Trials after which the help rate is taken; 36 pairs matter.
CHECKPOINTS = (36, 72, 135, 144, 216, 288, 360)
#: Trials between two fits of the shared prior.
REFIT = 6


class ExplorationStrategy(StrEnum):
    """How the next pair of state and action is chosen."""

    UNIFORM = 'uniform'
    SYSTEMATIC = 'systematic'
    INFORMATION_GAIN = 'information-gain'


class HelpRateCurve(NamedTuple):
    """Mean help rate at the checkpoints and its standard error, of one policy and estimate."""

    policy: ExplorationStrategy
    estimate: str
    mean: FloatArray
    error: FloatArray


def world_of(model: RobotModel) -> FloatArray:
    """The model's transition probabilities, shape [object, x_i, a, x_f]."""
    return np.array([known.transition for known in model.objects.values()])


def exploration(
    world: FloatArray,
    policy: ExplorationStrategy,
    seeds: int,
    checkpoints: Sequence[int] = CHECKPOINTS,
    seed: int = 0,
    domain: Domain = TABLETOP,
) -> list[HelpRateCurve]:
    """Learn in the world and act on the learned model, `seeds` times; one curve for each estimate.

    world: shape [object, x_i, a, x_f]; trials are drawn from it. domain: its states and actions.
    """
    rng = np.random.default_rng([seed, list(ExplorationStrategy).index(policy)])
    counts, aims = np.zeros((seeds, *world.shape)), domain.state_aims
    gain = np.zeros(counts.shape[:-1])
    weights, reached = START, []
    every, touched = np.arange(seeds), None
    trials = range(max(checkpoints))
    for trial in counted(trials, f'trials by {policy.value}', len(trials)):
        if policy is ExplorationStrategy.INFORMATION_GAIN:
            redraw_all = trial % (2 * REFIT) == 0
            if trial % REFIT == 0:
                weights = fit_weights(counts, aims, weights)
            alpha = counts + shared_prior(counts, weights, aims)
            if redraw_all or touched is None:
                gain = information_gain(alpha, rng, domain=domain)
            else:
                gain[every, touched] = information_gain(alpha[every, touched], rng, domain=domain)
        o, x_i, a = _chosen(policy, trial, gain, rng, domain)
        touched = o
        counts[every, o, x_i, a, _ended(world[o, x_i, a], rng)] += 1
        if trial + 1 in checkpoints:
            reached.append(_rates(counts, world, domain))
    rates = np.array(reached)  # [checkpoint, estimate, seed]
    error = rates.std(axis=-1) / np.sqrt(seeds)
    return [
        HelpRateCurve(policy, name, rates[:, e].mean(axis=-1), error[:, e])
        for e, name in enumerate(('maximum likelihood', 'Dirichlet', 'shared prior'))
    ]


def _rates(counts: FloatArray, world: FloatArray, domain: Domain) -> list[FloatArray]:
    aims = domain.state_aims
    shared = shared_prior(counts, fit_weights(counts, aims, rounds=3), aims)
    return [
        help_rate(maximum_likelihood(counts + prior), world, domain=domain)
        for prior in (0.0, CONCENTRATION, shared)
    ]


def _chosen(
    policy: ExplorationStrategy,
    trial: int,
    gain: FloatArray,
    rng: np.random.Generator,
    domain: Domain,
) -> tuple[IntArray, IntArray, IntArray]:
    """Object, x_i and action for each seed; x_i is within reach."""
    seeds, objects, _, actions = gain.shape
    open_ = np.flatnonzero(~domain.stuck)
    pairs = objects * len(open_) * actions
    if policy is ExplorationStrategy.UNIFORM:
        flat = rng.integers(pairs, size=seeds)
    elif policy is ExplorationStrategy.SYSTEMATIC:
        flat = np.full(seeds, trial % pairs)
    else:
        within = gain[:, :, open_] * (1 + 1e-9 * rng.random((seeds, objects, len(open_), actions)))
        flat = within.reshape(seeds, -1).argmax(axis=-1)
    o, x, a = np.unravel_index(flat, (objects, len(open_), actions))
    return o, open_[x], a


def _ended(rows: FloatArray, rng: np.random.Generator) -> IntArray:
    """Draw x_f from each row, shape [seed, x_f]."""
    above = rng.random(len(rows))[:, None] >= rows.cumsum(axis=-1)
    return np.asarray(above.sum(axis=-1).clip(max=rows.shape[-1] - 1))
