"""Executed imitation as text: Table 1 with predictions, and their calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from likeme_experiments.evaluation.forecast import Approach

#: Characters of a column.
WIDE = 28


def executed_text(document: Mapping[str, Any]) -> str:
    """The report as text."""
    shown = document['demonstrations']
    lines = [
        f'Table 1 executed in the simulated cell by {document["model"]}, which acts on the '
        f'{document["estimate"]} estimate;',
        f'{document["seeds"]} seeds of each change. Each cell: executed success [95 % bounds], '
        'then predicted success.',
        f'{"shown by":9}{"object":9}' + ''.join(f'{approach:>{WIDE}}' for approach in Approach),
    ]
    for row in document['rows']:
        lines.append(f'{row["demonstration"]:9}{row["object"]:9}' + _cells(row))
    lines.append(f'{"mean":18}' + _cells(document['averages']))
    lines.append(f'{"asks for help":18}' + _help(document['averages']))
    lines.append(
        f'Of {shown["shown"]} demonstrations perception reported {shown["understood"]} '
        f'correctly and {shown["misread"]} wrongly, and missed {shown["not_seen"]}.'
    )
    return '\n'.join([*lines, *_calibration(document), *_estimates(document), *_bars(document)])


def _cells(scores: Mapping[str, Any]) -> str:
    return ''.join(f'{_cell(scores[approach]):>{WIDE}}' for approach in Approach)


def _cell(s: Mapping[str, float]) -> str:
    return f'{s["success"]:.3f} [{s["low"]:.2f}, {s["high"]:.2f}] {s["predicted"]:.3f}'


def _help(scores: Mapping[str, Any]) -> str:
    rates = []
    for approach in Approach:
        s = scores[approach]
        rates.append(
            f'{s["help_rate"]:.3f}, {s["predicted_help_rate"]:.3f}' if approach.helped else ''
        )
    return ''.join(f'{each:>{WIDE}}' for each in rates)


def _calibration(document: Mapping[str, Any]) -> list[str]:
    found = document['calibration']
    later, over = found['later_actions'], found['optimism']
    by_mode = ', '.join(f'{name} {share:.2f}' for name, share in found['inside_by_mode'].items())
    return [
        '',
        f'Calibration over {len(found["cells"])} cells of object, change and action: expected '
        f'error {found["expected_calibration_error"]:.3f}.',
        f'{100 * found["inside"]:.0f} % of {found["inside_of"]} cells of object, change, '
        f"demonstration and mode lie in the model's own 95 % interval ({by_mode}).",
        'Predicted minus executed: trajectory, whose action is not chosen, '
        f'{over["trajectory"]:+.3f}; goal_based, chosen as the best of noisy rows, '
        f'{over["goal_based"]:+.3f}.',
        f'Second and third actions, from where the previous one left the object: predicted '
        f'{later["predicted"]:.3f}, achieved {later["achieved"]:.3f} (n = {later["n"]}).',
    ]


def _estimates(document: Mapping[str, Any]) -> list[str]:
    lines = [
        '',
        f'{"estimate":22}'
        + ''.join(f'{approach:>22}' for approach in Approach)
        + f'{"help rate":>12}',
    ]
    for name, each in document['estimates'].items():
        scores = each['averages']
        cells = ''.join(f'{scores[approach]["success"]:22.3f}' for approach in Approach)
        lines.append(f'{name:22}{cells}{scores[Approach.SEQUENTIAL_WITH_HELP]["help_rate"]:12.3f}')
    return lines


def _bars(document: Mapping[str, Any]) -> list[str]:
    lines = ['']
    for name, bar in document['bars'].items():
        verdict = 'met' if bar['met'] else 'MISSED'
        lines.append(f'{name:44}{bar["measured"]:.3f} {bar["rule"]} {bar["bar"]:.3f}  {verdict}')
    if document['averages'][Approach.INTERACTIVE]['predicted_help_rate'] == 0:
        lines.append(
            f'No best action is predicted to succeed with less than {document["threshold"]:.2f}: '
            'the interactive mode never asks and acts as goal_based.'
        )
    return lines
