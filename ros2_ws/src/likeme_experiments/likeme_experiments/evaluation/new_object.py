"""Help rate for an object the robot has no or few trials of, by what it borrows.

Each object of a model is left out in turn: the others keep all their trials, the object gets
trials of greatest `information_gain`, one at a time, that end as often as its own trials did. The
robot then acts up to three times by the plan on what it knows, and asks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from likeme_inference.tabletop.active_exploration import help_rate, information_gain
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.dirichlet import CONCENTRATION
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.shared_prior import fit_weights, shared_prior
from likeme_inference.tabletop.structure_fit import fit_structure
from likeme_inference.tabletop.structured_prior import StructuredPrior
from likeme_inference.tabletop.transition_model import maximum_likelihood

#: Trials of the new object after which the help rate is taken.
CHECKPOINTS = (0, 5, 10, 20)

#: Dirichlet pseudo-counts of one object, shape [x_i, a, x_f], from counts[object, x_i, a, x_f].
Estimate = Callable[[FloatArray], FloatArray]


class NewObject(NamedTuple):
    """How well a prior serves a new object.

    Attributes:
        help_rate: after each number of trials, shape [checkpoint], the mean over objects.
        error: standard error of it over seeds, shape [checkpoint].
    """

    prior: Prior
    help_rate: FloatArray
    error: FloatArray


def new_object(
    model: RobotModel,
    prior: Prior,
    seeds: int,
    checkpoints: Sequence[int] = CHECKPOINTS,
    seed: int = 0,
) -> NewObject:
    """Leave each object out in turn; Prior.OWN is Dirichlet with `CONCENTRATION`."""
    domain = model.domain
    trials = np.array([known.counts for known in model.objects.values()], dtype=np.float64)
    rates = np.zeros((len(checkpoints), seeds, len(trials)))
    for o in range(len(trials)):
        others = trials.copy()
        others[o] = 0
        estimate = _estimate(model, prior, others, o)
        world = maximum_likelihood(trials[o])
        for run in range(seeds):
            rng = np.random.default_rng([seed, o, run])
            counts = others.copy()
            for n in range(max(checkpoints) + 1):
                alpha = counts[o] + estimate(counts)
                if n in checkpoints:
                    learned = maximum_likelihood(alpha)[None]
                    rates[list(checkpoints).index(n), run, o] = help_rate(
                        learned, world[None], domain=domain
                    )
                gain = information_gain(alpha, rng, domain=domain)
                gain = np.where(domain.stuck[:, None], -1.0, gain * (1 + 1e-9 * rng.random()))
                x, a = np.unravel_index(int(gain.argmax()), gain.shape)
                counts[o, x, a, rng.choice(len(domain.states), p=world[x, a])] += 1
    by_seed = rates.mean(axis=-1)
    return NewObject(
        prior,
        by_seed.mean(axis=-1),
        by_seed.std(axis=-1) / np.sqrt(seeds),
    )


def untried_log_loss(model: RobotModel, prior: Prior | None) -> float:
    """Mean of -log p of the trials of each object within reach, given the others' alone, nats.

    prior: None for pooling, relative frequencies of the others' trials, with CONCENTRATION.
    """
    open_ = ~model.domain.stuck
    trials = np.array([known.counts for known in model.objects.values()], dtype=np.float64)
    total = 0.0
    for o, own in enumerate(trials):
        others = trials.copy()
        others[o] = 0
        if prior is None:
            alpha = others.sum(axis=0) + CONCENTRATION
        else:
            alpha = _estimate(model, prior, others, o)(others)
        total -= float((own * np.log(maximum_likelihood(alpha)))[open_].sum())
    return total / float(trials[:, open_].sum())


def _estimate(model: RobotModel, prior: Prior, others: FloatArray, o: int) -> Estimate:
    domain = model.domain
    if prior is Prior.OWN:
        return lambda counts: np.full(domain.shape, CONCENTRATION)
    if prior is Prior.SHARED:
        aims = domain.state_aims
        return lambda counts: shared_prior(counts, fit_weights(counts, aims, rounds=3), aims)[o]
    # The trials of the others decide on the structure: fitting it anew to each trial takes long.
    structure = fit_structure(others, domain)
    return lambda counts: StructuredPrior(counts, domain, structure).pseudo_counts[o]
