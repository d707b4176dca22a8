"""Directed exploration: help rate against number of trials (future work of the paper)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

from likeme_core.world.file import DEFAULT_WORLD
from likeme_experiments.evaluation.exploration import (
    CHECKPOINTS,
    ExplorationStrategy,
    HelpRateCurve,
    exploration,
    world_of,
)
from likeme_experiments.reproductions.exploration_figure import curves_figure
from likeme_experiments.reproductions.models import LEARNED, model_of
from likeme_experiments.reproductions.report import (
    Reproduction,
    ReproductionOptions,
    ReproductionReport,
)
from likeme_experiments.reproductions.text_table import aligned, paragraph
from likeme_inference.tabletop.active_exploration import help_rate
from likeme_inference.tabletop.robot_model import RobotModel

SEEDS = 200
#: The simulated cell as a world: a campaign other than the one the robot learned from.
WORLD_SEED, WORLD_REPETITIONS = 2, 40


class ExploredWorld(NamedTuple):
    """Help rates in one world.

    Attributes:
        name: whose relative frequencies the world is.
        known: help rate with the world's own transition probabilities.
        curves: one for each policy and estimate.
    """

    name: str
    known: float
    curves: list[HelpRateCurve]


def report_exploration(options: ReproductionOptions) -> ReproductionReport:
    """Help rate against number of trials by each policy, in each world."""
    seeds = options.seeds or SEEDS
    worlds = [_explored(model, seeds) for model in _models(options)]
    first, *others = [_document(world) for world in worlds]
    document = {'seeds': seeds, 'trials': list(CHECKPOINTS), **first}
    document |= {'beside': others[0]} if others else {}
    return ReproductionReport(
        document,
        '\n'.join(
            _text(f'ExploredWorld: {w.name}; {seeds} seeds', w.known, w.curves) for w in worlds
        ),
        lambda: curves_figure(
            {f'{w.name}; {seeds} seeds': (w.curves, w.known) for w in worlds}, CHECKPOINTS
        ),
    )


def _models(options: ReproductionOptions) -> list[RobotModel]:
    """The worlds: the model's, and for the simulated cell the real robot's beside it."""
    if options.model != LEARNED:
        return [model_of(options)]
    # Takes a second to import.
    from likeme_experiments.learning.self_taught_model import self_taught

    cell = self_taught(options.world, options.workers, WORLD_SEED, WORLD_REPETITIONS)
    own = replace(cell, name='simulated_cell')
    papers = options.world.source == DEFAULT_WORLD
    return [own, model_of(ReproductionOptions())] if papers else [own]


def _explored(model: RobotModel, seeds: int) -> ExploredWorld:
    world = world_of(model)
    curves = [
        curve
        for policy in ExplorationStrategy
        for curve in exploration(world, policy, seeds, domain=model.domain)
    ]
    return ExploredWorld(
        f'{model.label}{_trials(model)}',
        float(help_rate(world, world, domain=model.domain)),
        curves,
    )


def _trials(model: RobotModel) -> str:
    return f' ({sum(known.trials for known in model.objects.values())} trials)'


def _document(world: ExploredWorld) -> dict[str, Any]:
    return {
        'world': world.name,
        'world_known': world.known,
        'curves': [_row(curve) for curve in world.curves],
    }


def _row(curve: HelpRateCurve) -> dict[str, Any]:
    return {
        'policy': curve.policy.value,
        'estimate': curve.estimate,
        'help_rate': curve.mean.tolist(),
        'standard_error': curve.error.tolist(),
    }


def _text(title: str, known: float, curves: list[HelpRateCurve]) -> str:
    rows = [['policy', 'estimate', *map(str, CHECKPOINTS)]]
    for curve in curves:
        for first, values in (
            ((curve.policy.value, curve.estimate), curve.mean),
            (('', 'standard error'), curve.error),
        ):
            rows.append([*first, *(f'{100 * value:.2f}' for value in values)])
    return '\n'.join(
        [
            paragraph(
                'Help rate, %, after so many trials of learning, acting up to 3 times, and its '
                f'standard error. {title}. Knowing the world: {100 * known:.2f} %. '
                'The paper explores exhaustively, and leaves directed exploration to future work.'
            ),
            *aligned(rows, left=2),
        ]
    )


REPRODUCTIONS = {
    'exploration': Reproduction(
        'Directed exploration: help rate against trials',
        report_exploration,
        frozenset({'world', 'seeds', 'model', 'workers'}),
    ),
}
