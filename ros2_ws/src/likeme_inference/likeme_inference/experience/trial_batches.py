"""Trials in the order in which they were made, for checks of whether the world stayed the same."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from likeme_core.world import World
from likeme_inference.experience.trial import Pair, Trial
from likeme_inference.tabletop.arrays import IntArray


def batches_in_order(
    trials: Iterable[Trial], world: World, objects: tuple[str, ...], batches: int = 2
) -> IntArray:
    """Counts of the trials in consecutive parts, shape [batch, object, x_i, a, x_f].

    The trials of each pair are ordered by their time (and repetition) and divided into parts of
    equal size; where they do not divide, the later parts have one trial more.

    Raises:
        ValueError: less than one batch.
    """
    if batches < 1:
        raise ValueError(f'Expected at least 1 batch, got {batches}.')
    ordered: dict[Pair, list[Trial]] = {}
    for trial in trials:
        if trial.key.pair.object in objects:
            ordered.setdefault(trial.key.pair, []).append(trial)
    states, actions = len(world.states), len(world.actions)
    counts = np.zeros((batches, len(objects), states, actions, states), dtype=np.int64)
    for pair, made in ordered.items():
        made.sort(key=lambda trial: (trial.time, trial.key.repetition))
        o = objects.index(pair.object)
        for k, trial in enumerate(made):
            batch = ((k + 1) * batches - 1) // len(made)
            counts[batch, o, pair.x_i, pair.action, trial.x_f] += 1
    return counts
