"""Executed imitation as text: Table 1 with predictions, and their calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from likeme_experiments.evaluation.forecast import Approach
from likeme_experiments.reproductions.text_table import aligned, paragraph, short

#: Headings of the columns.
HEADINGS = {Approach.SEQUENTIAL_WITH_HELP: 'and help'}
#: Names of estimates, for 80 columns.
SHORT = {'maximum likelihood': 'ML'}


def executed_text(document: Mapping[str, Any]) -> str:
    """The report as text; the bounds of single cells are in the document."""
    shown = document['demonstrations']
    averages = document['averages']
    rows = [
        ['shown by', 'object', *(HEADINGS.get(each, each.value) for each in Approach)],
        *(line for row in document['rows'] for line in _lines(row)),
        ['mean', '', *_cells(averages)],
        ['95 % of it', '', *(_bounds(averages[approach]) for approach in Approach)],
        ['asks', '', *_help(averages)],
    ]
    return '\n'.join(
        [
            paragraph(
                f'Table 1 executed in the simulated cell by {document["model"]}, which acts on '
                f'the {document["estimate"]} estimate; {document["seeds"]} seeds of each change. '
                'Each cell: executed, then predicted success; with "and help" a human gives it '
                'when the sequential mode asks. (paper): its hypothetical success, Table 1.'
            ),
            *aligned(rows, left=2),
            paragraph(
                f'Of {shown["shown"]} demonstrations perception reported {shown["understood"]} '
                f'correctly and {shown["misread"]} wrongly, and missed {shown["not_seen"]}.'
            ),
            *_refused(document),
            *_calibration(document),
            *_estimates(document),
            *_bars(document),
        ]
    )


def _refused(document: Mapping[str, Any]) -> list[str]:
    """With all objects on the table, what the others kept from being begun."""
    if 'refused' not in document:
        return []
    shares = ', '.join(f'{mode} {short(share)}' for mode, share in document['refused'].items())
    return [paragraph(f'Share of actions not begun, as others were in the way: {shares}.')]


def _lines(row: Mapping[str, Any]) -> list[list[str]]:
    """A row, and the paper's below it where it has one."""
    lines = [[row['demonstration'], row['object'], *_cells(row)]]
    if paper := row['paper']:
        cells = [short(paper[a], 4).ljust(9) if a in paper else '' for a in Approach]
        lines.append(['', '(paper)', *cells])
    return lines


def _cells(scores: Mapping[str, Any]) -> list[str]:
    pairs = ((scores[each]['success'], scores[each]['predicted']) for each in Approach)
    return [f'{short(success, 3)} {short(predicted, 3)}' for success, predicted in pairs]


def _bounds(score: Mapping[str, float]) -> str:
    return f'{short(score["low"])}-{short(score["high"])}'


def _help(scores: Mapping[str, Any]) -> list[str]:
    rates = ((scores[each], each.helped) for each in Approach)
    return [
        f'{short(s["help_rate"], 3)} {short(s["predicted_help_rate"], 3)}' if helped else ''
        for s, helped in rates
    ]


def _calibration(document: Mapping[str, Any]) -> list[str]:
    found = document['calibration']
    later, over = found['later_actions'], found['optimism']
    by_mode = ', '.join(f'{name} {share:.2f}' for name, share in found['inside_by_mode'].items())
    return [
        '',
        *map(
            paragraph,
            (
                f'Calibration over {len(found["cells"])} cells of object, change and action: '
                f'expected error {found["expected_calibration_error"]:.3f}.',
                f'{100 * found["inside"]:.0f} % of {found["inside_of"]} cells of object, change, '
                "demonstration and mode lie in the model's own 95 % interval "
                f'({by_mode}).',
                'Predicted minus executed: trajectory, whose action is not chosen, '
                f'{over["trajectory"]:+.3f}; goal_based, chosen as the best of noisy rows, '
                f'{over["goal_based"]:+.3f}.',
                'Second and third actions, from where the previous one left the object: predicted '
                f'{later["predicted"]:.3f}, achieved {later["achieved"]:.3f} (n = {later["n"]}).',
            ),
        ),
    ]


def _estimates(document: Mapping[str, Any]) -> list[str]:
    rows = [['estimate', *(HEADINGS.get(each, each.value) for each in Approach), 'asks']]
    for name, each in document['estimates'].items():
        scores = each['averages']
        asks = scores[Approach.SEQUENTIAL_WITH_HELP]['help_rate']
        success = [scores[approach]['success'] for approach in Approach]
        rows.append([SHORT.get(name, name), *(short(value, 3) for value in (*success, asks))])
    return ['', *aligned(rows, left=1)]


def _bars(document: Mapping[str, Any]) -> list[str]:
    rows = [
        [name, f'{bar["measured"]:.3f} {bar["rule"]} {bar["bar"]:.3f}', _verdict(bar['met'])]
        for name, bar in document['bars'].items()
    ]
    lines = ['', *aligned(rows, left=1)]
    if document['averages'][Approach.INTERACTIVE]['predicted_help_rate'] == 0:
        lines.append(
            paragraph(
                'No best action is predicted to succeed with less than '
                f'{document["threshold"]:.2f}: the interactive mode never asks and acts as '
                'goal_based.'
            )
        )
    return lines


def _verdict(met: bool) -> str:
    return 'met' if met else 'MISSED'
