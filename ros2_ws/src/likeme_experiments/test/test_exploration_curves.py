"""Help rate against trials for directed and uniform exploration."""

from __future__ import annotations

from likeme_experiments.evaluation.exploration import ExplorationStrategy, exploration, world_of
from likeme_inference.tabletop.model_file import shipped


def test_directed_trials_reduce_the_help_rate_faster_than_uniform_ones() -> None:
    world = world_of(shipped())
    directed = exploration(world, ExplorationStrategy.INFORMATION_GAIN, 40, (72,))[-1]
    uniform = exploration(world, ExplorationStrategy.UNIFORM, 400, (72,))
    assert directed.mean[0] < min(curve.mean[0] for curve in uniform) - 2 * directed.error[0]
