"""Table 1 executed: in the simulated cell, through the camera, with a self-learned model."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from likeme_core.tabletop import Manner, Mode
from likeme_core.world import World
from likeme_experiments.evaluation.episode import ImitationEpisode, ImitationResult
from likeme_experiments.evaluation.executed import (
    ApproachScore,
    IntervalCheck,
    calibration_error_of,
)
from likeme_experiments.evaluation.executed_summary import ExecutedSummary, executed_summary
from likeme_experiments.evaluation.forecast import BUDGET, THRESHOLD, Approach
from likeme_experiments.evaluation.table1 import MODES, PAPER
from likeme_experiments.learning.store_location import default_place
from likeme_experiments.reproductions.executed_figure import executed_figure
from likeme_experiments.reproductions.executed_text import executed_text
from likeme_experiments.reproductions.models import LEARNED, model_of
from likeme_experiments.reproductions.report import (
    Reproduction,
    ReproductionOptions,
    ReproductionReport,
)
from likeme_inference.tabletop import model_file
from likeme_inference.tabletop.domain import TABLETOP, domain_of
from likeme_inference.tabletop.robot_model import RobotModel

SEEDS = 20
#: The estimate of the table; the document also has the averages of the others.
ESTIMATE = 'Dirichlet'
#: Share of cells that must lie in the model's own 95 % interval.
INSIDE = 0.9


def report_executed(options: ReproductionOptions) -> ReproductionReport:
    """Make the missing episodes and score all of them."""
    # Takes two seconds to import; the list of names does not need it.
    from likeme_experiments.imitation.episode_log import EpisodeLog
    from likeme_experiments.imitation.episodes import ESTIMATES, EpisodeFailedError, tasks
    from likeme_experiments.imitation.runner import episodes

    seeds, workers = options.seeds or SEEDS, options.workers or len(os.sched_getaffinity(0))
    world = options.world
    model = model_of(ReproductionOptions(world, None, options.model or LEARNED, workers))
    text, wanted = model_file.format_model(model), tasks(world, _objects(world, model), seeds)
    folder = Path(default_place(world)).with_name('table1-executed')
    log = EpisodeLog(folder, text, world, options.together)
    try:
        made = episodes(world, wanted, text, log, workers, Console(stderr=True), options.together)
    except EpisodeFailedError as error:
        raise ValueError(str(error)) from error
    found = {
        name: executed_summary(world, model, made, name, by) for name, by in ESTIMATES.items()
    }
    document = document_of(model, seeds, made, found, ESTIMATE)
    if options.together:
        document['refused'] = refused_shares(made, ESTIMATE)
    return ReproductionReport(
        document,
        executed_text(document),
        lambda: executed_figure(document),
    )


def _objects(world: World, model: RobotModel) -> tuple[str, ...]:
    """The objects of both cell and model.

    Raises:
        ValueError: there is none, or the model is of another table.
    """
    if model.domain != (ours := domain_of(world)):
        raise ValueError(f'Expected a model of {ours.states}, got {model.domain.states}.')
    known = tuple(name for name in world.objects if name in model.objects)
    if not known:
        raise ValueError(
            f'Expected a model of {", ".join(world.objects)}, got one of {list(model.objects)}.'
        )
    return known


def document_of(
    model: RobotModel,
    seeds: int,
    made: list[ImitationEpisode],
    found: dict[str, ExecutedSummary],
    estimate: str,
) -> dict[str, Any]:
    """All results as a JSON document; the rows are of one estimate."""
    chosen = found[estimate]
    return {
        'model': model.label,
        'sources': dict(model.sources),
        'seeds': seeds,
        'estimate': estimate,
        'threshold': THRESHOLD,
        'actions': BUDGET,
        'interval': 'Clopper-Pearson, 95 %',
        'demonstrations': _understood(made),
        'rows': [
            {
                'demonstration': manner.name.lower(),
                'object': name,
                'paper': _printed(manner, name) if model.domain == TABLETOP else {},
            }
            | _scores(scores)
            for (manner, name), scores in chosen.rows.items()
        ],
        'averages': _scores(chosen.averages),
        'by_change': [_cell(cell) for cell in chosen.cells],
        'calibration': _calibration(chosen),
        'estimates': {
            name: {
                'averages': _scores(each.averages),
                'expected_calibration_error': calibration_error_of(each.actions),
                'inside': each.inside,
                'optimism': _optimism(each),
            }
            for name, each in found.items()
        },
        'gains': {name: gain._asdict() for name, gain in chosen.gains.items()},
        'bars': _bars(chosen),
    }


def _printed(manner: Manner, name: str) -> dict[str, float]:
    """What the paper's Table 1 prints, by approach."""
    return {
        mode.name.lower(): success
        for mode, success in zip(MODES, PAPER.get((manner, name), ()), strict=False)
    }


def refused_shares(made: Sequence[ImitationEpisode], estimate: str) -> dict[str, float]:
    """Share of the actions of each mode that other objects kept from being begun."""
    of: dict[Mode, list[ImitationResult]] = {}
    for each in made:
        for mode, result in each.results[estimate].items():
            of.setdefault(mode, []).append(result)
    return {
        mode.name.lower(): sum(r.refused for r in results)
        / max(sum(len(r.actions) for r in results), 1)
        for mode, results in of.items()
    }


def _understood(made: list[ImitationEpisode]) -> dict[str, int]:
    return {
        'shown': len(made),
        'understood': sum(e.understood for e in made),
        'not_seen': sum(not e.perceived for e in made),
        'misread': sum(bool(e.perceived) and not e.understood for e in made),
    }


def _scores(scores: dict[Approach, ApproachScore]) -> dict[str, Any]:
    return {
        approach.value: {
            'success': s.success, 'low': s.bounds.low, 'high': s.bounds.high,
            'predicted': s.predicted, 'n': s.tries, 'help_rate': s.helped,
            'predicted_help_rate': s.predicted_help,
        }
        for approach, s in scores.items()
    }  # fmt: skip


def _cell(cell: IntervalCheck) -> dict[str, Any]:
    name, x_i, x_f, manner = cell.case
    return {
        'demonstration': manner.name.lower(), 'object': name, 'x_i': x_i.name, 'x_f': x_f.name,
        'mode': cell.approach.value, 'success': cell.score.success, 'low': cell.score.bounds.low,
        'high': cell.score.bounds.high, 'predicted': cell.score.predicted, 'n': cell.score.tries,
        'expected_low': cell.expected.low, 'expected_high': cell.expected.high,
        'inside': cell.inside, 'asks': cell.asks,
    }  # fmt: skip


def _calibration(found: ExecutedSummary) -> dict[str, Any]:
    predicted, achieved, count = found.later
    by_approach = {
        approach.value: float(np.mean([c.inside for c in found.acting if c.approach is approach]))
        for approach in dict.fromkeys(cell.approach for cell in found.acting)
    }
    return {
        'expected_calibration_error': calibration_error_of(found.actions),
        'cells': [
            {
                'object': c.object, 'x_i': c.x_i.name, 'x_f': c.x_f.name, 'action': c.action.name,
                'predicted': c.predicted, 'achieved': c.successes / c.tries, 'n': c.tries,
            }
            for c in found.actions
        ],
        'inside': found.inside,
        'inside_of': len(found.acting),
        'inside_by_mode': by_approach,
        'inside_with_asked': float(np.mean([cell.inside for cell in found.cells])),
        'optimism': _optimism(found),
        'later_actions': {'predicted': predicted, 'achieved': achieved, 'n': count},
    }  # fmt: skip


def _optimism(found: ExecutedSummary) -> dict[str, float]:
    """Predicted minus executed success; positive for actions chosen as the best of noisy rows."""
    return {approach.value: s.predicted - s.success for approach, s in found.averages.items()}


def _bars(found: ExecutedSummary) -> dict[str, Any]:
    of = {approach: s.success for approach, s in found.averages.items()}
    helped, asked = (
        found.averages[Approach.SEQUENTIAL_WITH_HELP],
        found.averages[Approach.INTERACTIVE],
    )
    measured: dict[str, tuple[float, str, float, bool]] = {
        'inside_95': (found.inside, '>=', INSIDE, found.inside >= INSIDE)
    }
    for name, more, less in (
        ('interactive', Approach.INTERACTIVE, Approach.GOAL_BASED),
        ('goal_based', Approach.GOAL_BASED, Approach.TRAJECTORY),
        ('sequential', Approach.SEQUENTIAL, Approach.GOAL_BASED),
    ):
        measured[f'{name}_over_{less.value}'] = (of[more], '>', of[less], of[more] > of[less])
    measured['sequential_with_help_at_least_interactive'] = (
        helped.success, '>=', asked.success, helped.success >= asked.success,
    )  # fmt: skip
    measured['sequential_help_rate_below_interactive'] = (
        helped.helped, '<', asked.helped, helped.helped < asked.helped,
    )  # fmt: skip
    return {
        name: {'measured': value, 'rule': rule, 'bar': bar, 'met': met}
        for name, (value, rule, bar, met) in measured.items()
    }


REPRODUCTIONS = {
    'table1-executed': Reproduction(
        'Table 1 executed in the simulated cell with a self-learned model (20 minutes)',
        report_executed,
        frozenset({'world', 'seeds', 'model', 'workers', 'together'}),
        in_all=False,
    ),
}
