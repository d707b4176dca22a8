"""Executed imitation as one JSON document."""

from __future__ import annotations

from typing import Any

import numpy as np

from likeme_experiments.evaluation.episode import Episode
from likeme_experiments.evaluation.executed import Checked, Score, error_of
from likeme_experiments.evaluation.forecast import BUDGET, THRESHOLD, Way
from likeme_experiments.reproductions.executed_findings import Findings
from likeme_inference.tabletop.robot_model import RobotModel

#: Share of cells that must lie in the model's own 95 % interval.
INSIDE = 0.9


def document_of(
    model: RobotModel,
    seeds: int,
    made: list[Episode],
    found: dict[str, Findings],
    estimate: str,
) -> dict[str, Any]:
    """A JSON document of everything, the rows by one estimate."""
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
