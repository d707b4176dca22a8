"""Help rate for an object that is new to the robot, by its prior.

The world is the real robot's table; each of its objects is left out in turn (evaluation/
new_object.py of likeme_experiments, seeds [0, object, run]).
"""

from __future__ import annotations

from argparse import Namespace

import numpy as np

from likeme_core.world import load_world
from likeme_experiments.evaluation.new_object import CHECKPOINTS, new_object, untried_log_loss
from likeme_inference.tabletop import help_rate, shipped
from likeme_inference.tabletop.prior import Prior
from report import Bar

SEEDS = 100
#: Help rate, %, after CHECKPOINTS trials of the new object; log loss before any, nats.
HELP_RATES = (10.0, 8.0, 7.9, 7.4)
LOG_LOSS = 0.604
#: Worlds of simulated robots; by how much the structured prior may be worse than pooling, nats.
OTHERS, WORSE = ('one_more_manner', 'three_bins'), 0.002


def bars(options: Namespace) -> list[Bar]:
    """Structured prior against its bars; the other priors, and the world known, beside it."""
    seeds = SEEDS if options.seeds is None else max(1, options.seeds)
    model, made = shipped(), []
    for prior in (Prior.STRUCTURED, Prior.SHARED, Prior.OWN):
        found, ours = new_object(model, prior, seeds), prior is Prior.STRUCTURED
        for n, rate, error, bar in zip(
            CHECKPOINTS, found.help_rate, found.error, HELP_RATES, strict=True
        ):
            name = f'new object, {prior}: help rate after {n} trials'
            made.append(Bar(name, 100 * rate, bar if ours else None, '%', n=3 * seeds))
            name = f'new object, {prior}: standard error after {n} trials'
            made.append(Bar(name, 100 * error, None, '%', n=seeds))
    world = np.array([known.transition for known in model.objects.values()])
    floor = 100 * float(help_rate(world, world))
    made.append(Bar('new object: help rate, world known', floor, None, '%', n=3))
    for world_name in (None, *OTHERS):
        made += _losses(world_name)
    return made


def _losses(name: str | None) -> list[Bar]:
    """Log loss of an object's trials before any; in other worlds also against pooling."""
    model = shipped(None if name is None else load_world(name))
    trials = sum(int(known.counts[~model.domain.stuck].sum()) for known in model.objects.values())
    losses = {prior: untried_log_loss(model, prior) for prior in (*Prior, None)}
    what, found = f'log loss of an untried object, {name or "chung2015"}', []
    for prior, loss in losses.items():
        bar = LOG_LOSS if name is None and prior is Prior.STRUCTURED else None
        found.append(Bar(f'{what}: {prior or "pooling"}', loss, bar, 'nats', n=trials))
    over = losses[Prior.STRUCTURED] - losses[None]
    return [*found, Bar(f'{what}: structured over pooling', over, WORSE, 'nats', n=trials)]
