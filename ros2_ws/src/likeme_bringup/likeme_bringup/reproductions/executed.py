"""Table 1 carried out: in the simulated cell, through the camera, with a self-learned model."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console

from likeme_arm_sim.scene import OBJECTS
from likeme_bringup.learning.keeping import default_place
from likeme_bringup.reproductions.executed_figure import executed_figure
from likeme_bringup.reproductions.executed_text import executed_text
from likeme_bringup.reproductions.models import LEARNED, model_of
from likeme_bringup.reproductions.report import Options, Report, Reproduction
from likeme_inference.experiments.executed import (
    Checked,
    Difference,
    Episode,
    Reliability,
    Score,
    checked,
    difference,
    error_of,
    grouped,
    later_actions,
    reliability,
    score,
)
from likeme_inference.experiments.forecast import BUDGET, THRESHOLD, Estimate, Way, forecasts
from likeme_inference.tabletop import model_file
from likeme_inference.tabletop.domain import TABLETOP, Manner
from likeme_inference.tabletop.robot_model import RobotModel

SEEDS = 20
#: The estimate the table is about; the document holds the averages of all.
ESTIMATE = 'Dirichlet'
#: Share of cells that must lie in the model's own 95 % interval.
INSIDE = 0.9
#: Seed of the worlds drawn from the posterior.
WORLDS_SEED = 0


class Findings(NamedTuple):
    """Everything counted for one estimate.

    Attributes:
        rows: (manner, object) -> way -> score over four changes.
        averages: way -> score over all.
        cells: each case in each way against the model's interval.
        actions: each first action, predicted and achieved.
        later: predicted and achieved success of second and third actions, and how many.
        gains: name -> difference of two ways.
    """

    rows: dict[tuple[Manner, str], dict[Way, Score]]
    averages: dict[Way, Score]
    cells: list[Checked]
    actions: list[Reliability]
    later: tuple[float, float, int]
    gains: dict[str, Difference]

    @property
    def judged(self) -> list[Checked]:
        """Cells in which the robot itself had to do it: a person who is asked does not fail."""
        return [cell for cell in self.cells if not cell.asks]

    @property
    def inside(self) -> float:
        """Share of them whose executed success lies in the model's 95 % interval."""
        return float(np.mean([cell.inside for cell in self.judged]))


def report_executed(options: Options) -> Report:
    """Carry out what is missing and count."""
    # Takes two seconds to import, and who asks for the list needs none of it.
    from likeme_bringup.imitating.episodes import ESTIMATES, EpisodeFailedError, tasks
    from likeme_bringup.imitating.journal import Journal
    from likeme_bringup.imitating.running import episodes

    seeds, workers = options.seeds or SEEDS, options.workers or len(os.sched_getaffinity(0))
    model = model_of(Options(model=options.model or LEARNED, workers=workers))
    text, wanted = model_file.format_model(model), tasks(_objects(model), seeds)
    journal = Journal(Path(default_place()).with_name('table1-executed'), text)
    try:
        made = episodes(wanted, text, journal, workers, Console(stderr=True))
    except EpisodeFailedError as error:
        raise ValueError(str(error)) from error
    found = {name: findings(model, made, name, by) for name, by in ESTIMATES.items()}
    document = _document(model, seeds, made, found)
    return Report(
        document,
        executed_text(document),
        lambda: executed_figure(document),
    )


def _objects(model: RobotModel) -> tuple[str, ...]:
    """What the cell has and the model knows.

    Raises:
        ValueError: nothing, or the model is about another table.
    """
    if model.domain != TABLETOP:
        raise ValueError(f'Expected a model of {TABLETOP.states}, got {model.domain.states}.')
    known = tuple(name for name in OBJECTS if name in model.objects)
    if not known:
        raise ValueError(
            f'Expected a model of {", ".join(OBJECTS)}, got one of {list(model.objects)}.'
        )
    return known


def findings(model: RobotModel, made: list[Episode], estimate: str, by: Estimate) -> Findings:
    """Count the episodes of one estimate and hold them against the model's forecasts.

    estimate: its name in the episodes. by: the estimate.
    """
    rng = np.random.default_rng(WORLDS_SEED)
    expected = forecasts(model, list(grouped(made, lambda e: e.case)), rng, by)

    def predicted(name: str, x_i: int, action: int, x_f: int) -> float:
        return float(by.known(model, name).transition[x_i, action, x_f])

    def scores(group: tuple[Episode, ...]) -> dict[Way, Score]:
        return {way: score(group, estimate, way, expected) for way in Way}

    return Findings(
        {
            key: scores(group)
            for key, group in grouped(made, lambda e: (e.case.manner, e.case.object)).items()
        },
        scores(tuple(made)),
        checked(made, estimate, expected),
        reliability(made, estimate, predicted),
        later_actions(made, estimate, predicted),
        _gains(lambda more, less: difference(made, estimate, more, less)),
    )


def _gains(compare: Callable[[Way, Way], Difference]) -> dict[str, Difference]:
    return {
        'goal_based_over_trajectory': compare(Way.GOAL_BASED, Way.TRAJECTORY),
        'interactive_over_goal_based': compare(Way.INTERACTIVE, Way.GOAL_BASED),
        'sequential_over_goal_based': compare(Way.SEQUENTIAL, Way.GOAL_BASED),
        'sequential_with_help_over_interactive': compare(
            Way.SEQUENTIAL_WITH_HELP, Way.INTERACTIVE
        ),
    }


def _document(
    model: RobotModel, seeds: int, made: list[Episode], found: dict[str, Findings]
) -> dict[str, Any]:
    chosen = found[ESTIMATE]
    return {
        'model': model.label,
        'sources': dict(model.sources),
        'seeds': seeds,
        'estimate': ESTIMATE,
        'threshold': THRESHOLD,
        'actions': BUDGET,
        'interval': 'Clopper-Pearson, 95 %',
        'demonstrations': _understood(made),
        'rows': [
            {'demonstration': manner.name.lower(), 'object': name} | _scores(scores)
            for (manner, name), scores in chosen.rows.items()
        ],
        'averages': _scores(chosen.averages),
        'by_change': [_cell(cell) for cell in chosen.cells],
        'calibration': _calibration(chosen),
        'estimates': {
            name: {
                'averages': _scores(each.averages),
                'expected_calibration_error': error_of(each.actions),
                'inside': each.inside,
                'optimism': _optimism(each),
            }
            for name, each in found.items()
        },
        'gains': {name: gain._asdict() for name, gain in chosen.gains.items()},
        'bars': _bars(chosen),
    }


def _understood(made: list[Episode]) -> dict[str, int]:
    return {
        'shown': len(made),
        'understood': sum(e.understood for e in made),
        'not_seen': sum(not e.acts for e in made),
        'misread': sum(bool(e.acts) and not e.understood for e in made),
    }


def _scores(scores: dict[Way, Score]) -> dict[str, Any]:
    return {
        way.value: {
            'success': s.success, 'low': s.bounds.low, 'high': s.bounds.high,
            'predicted': s.predicted, 'n': s.tries, 'help_rate': s.helped,
            'predicted_help_rate': s.predicted_help,
        }
        for way, s in scores.items()
    }  # fmt: skip


def _cell(cell: Checked) -> dict[str, Any]:
    name, x_i, x_f, manner = cell.case
    return {
        'demonstration': manner.name.lower(), 'object': name, 'x_i': x_i.name, 'x_f': x_f.name,
        'mode': cell.way.value, 'success': cell.score.success, 'low': cell.score.bounds.low,
        'high': cell.score.bounds.high, 'predicted': cell.score.predicted, 'n': cell.score.tries,
        'expected_low': cell.expected.low, 'expected_high': cell.expected.high,
        'inside': cell.inside, 'asks': cell.asks,
    }  # fmt: skip


def _calibration(found: Findings) -> dict[str, Any]:
    predicted, achieved, count = found.later
    by_way = {
        way.value: float(np.mean([c.inside for c in found.judged if c.way is way]))
        for way in dict.fromkeys(cell.way for cell in found.judged)
    }
    return {
        'expected_calibration_error': error_of(found.actions),
        'cells': [
            {
                'object': c.object, 'x_i': c.x_i.name, 'x_f': c.x_f.name, 'action': c.action.name,
                'predicted': c.predicted, 'achieved': c.successes / c.tries, 'n': c.tries,
            }
            for c in found.actions
        ],
        'inside': found.inside,
        'inside_of': len(found.judged),
        'inside_by_mode': by_way,
        'inside_with_asked': float(np.mean([cell.inside for cell in found.cells])),
        'optimism': _optimism(found),
        'later_actions': {'predicted': predicted, 'achieved': achieved, 'n': count},
    }  # fmt: skip


def _optimism(found: Findings) -> dict[str, float]:
    """Predicted less executed success; chosen as the best of noisy rows, actions look better."""
    return {way.value: s.predicted - s.success for way, s in found.averages.items()}


def _bars(found: Findings) -> dict[str, Any]:
    of = {way: s.success for way, s in found.averages.items()}
    helped, asked = found.averages[Way.SEQUENTIAL_WITH_HELP], found.averages[Way.INTERACTIVE]
    measured: dict[str, tuple[float, str, float, bool]] = {
        'inside_95': (found.inside, '>=', INSIDE, found.inside >= INSIDE)
    }
    for name, more, less in (
        ('interactive', Way.INTERACTIVE, Way.GOAL_BASED),
        ('goal_based', Way.GOAL_BASED, Way.TRAJECTORY),
        ('sequential', Way.SEQUENTIAL, Way.GOAL_BASED),
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
        'Table 1 carried out in the simulated cell with a self-learned model (20 minutes)',
        report_executed,
        frozenset({'seeds', 'model', 'workers'}),
        in_all=False,
    ),
}
