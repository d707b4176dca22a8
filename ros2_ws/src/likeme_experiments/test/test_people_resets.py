"""Simulated campaigns: a plan needs hardly more resets by people than no order can save."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_core.world import load_world
from likeme_experiments.evaluation.people_resets import (
    SimulatedTable,
    asking_each_time,
    planned_campaign,
)
from likeme_inference.tabletop.model_file import shipped

SEEDS = range(2)


def table_of(name: str, seed: int) -> SimulatedTable:
    """The real robot's table, or a world of random probabilities."""
    world, rng = load_world(name), np.random.default_rng([seed, 0])
    if name == 'chung2015':
        known = {name: model.transition for name, model in shipped().objects.items()}
        return SimulatedTable(world, known, rng)
    states, shape = len(world.states), (len(world.states), len(world.actions))
    rows = {name: rng.dirichlet(np.full(states, 0.5), size=shape) for name in world.objects}
    for table in rows.values():
        for state in world.out_of_reach:
            table[state] = np.eye(states)[state]
    return SimulatedTable(world, rows, rng)


@pytest.mark.parametrize('world', ['chung2015', 'three_bins'])
def test_planned_campaigns_make_the_same_trials_with_few_resets(world: str) -> None:
    planned = [planned_campaign(table_of(world, seed), 2, seed) for seed in SEEDS]
    asking = [asking_each_time(table_of(world, seed), 2, seed) for seed in SEEDS]
    for ours, theirs in zip(planned, asking, strict=True):
        assert (ours.trials, theirs.transports) == (theirs.trials, 0)
        assert ours.resets < theirs.resets / 2
        assert ours.requests < ours.resets
        # Objects that were not put back, at the end and at first, are no resets.
        assert ours.resets >= ours.unavoidable
    assert sum(run.resets for run in planned) <= 1.5 * sum(run.unavoidable for run in planned)


def test_every_wanted_pair_is_tried() -> None:
    table = table_of('chung2015', 1)
    run = planned_campaign(table, 2, 1)
    for counts in table.counts.values():
        assert counts.sum(axis=-1).min() >= 2
    assert sum(int(counts.sum()) for counts in table.counts.values()) == (
        run.trials + run.transports
    )
