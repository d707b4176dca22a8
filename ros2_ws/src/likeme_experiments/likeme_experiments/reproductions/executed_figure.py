"""Figure of executed imitation: Table 1 with predictions, and a reliability diagram."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle
from typing import TYPE_CHECKING, Any

from likeme_experiments.evaluation.forecast import Approach
from likeme_experiments.evaluation.table1 import MANNER_NAMES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HEADINGS = {
    Approach.TRAJECTORY: 'Trajectory',
    Approach.GOAL_BASED: 'Goal-Based',
    Approach.INTERACTIVE: 'Interactive\nGoal-Based',
    Approach.SEQUENTIAL: 'Sequential,\n3 actions',
    Approach.SEQUENTIAL_WITH_HELP: 'Sequential,\nthen asking',
}
_MANNERS = {manner.name.lower(): name for manner, name in MANNER_NAMES.items()}
#: Of the objects in their order.
_COLOURS = ('#228833', '#ccbb44', '#aa3377', '#4477aa', '#ee8866', '#66ccee', '#999999')


def executed_figure(document: Mapping[str, Any]) -> Figure:
    """The table; below it the reliability diagram and the means."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 9.6), layout='constrained')
    above, below = figure.subfigures(2, 1, squeeze=False, height_ratios=(1.05, 1))[:, 0]
    _table(above.subplots(), document)
    above.suptitle(
        f'Table 1 executed by {document["model"]}: executed (predicted)\n'
        "[95 % bounds of the executed] {hypothetical in the paper's Table 1}",
        fontsize=11,
    )
    left, right = below.subplots(1, 2, width_ratios=(1, 1.1))
    _reliability(left, document['calibration'])
    _means(right, document['averages'])
    return figure


def _table(axes: Axes, document: Mapping[str, Any]) -> None:
    axes.set_axis_off()
    names, cells = [], []
    shown = {row['demonstration'] for row in document['rows']}
    for manner, heading in ((m, h) for m, h in _MANNERS.items() if m in shown):
        names.append(heading)
        cells.append([''] * len(Approach))
        for row in (row for row in document['rows'] if row['demonstration'] == manner):
            names.append(f'{row["object"].capitalize()}  ')
            cells.append([_cell(row[a]) + _printed(row['paper'].get(a)) for a in Approach])
    names.append('Mean  ')
    cells.append([_cell(document['averages'][approach]) for approach in Approach])
    drawn = axes.table(
        cells, rowLabels=names, colLabels=list(_HEADINGS.values()), loc='center', cellLoc='center'
    )
    drawn.auto_set_font_size(False)
    drawn.set_fontsize(8.5)
    drawn.scale(1, 2.05)
    for (line, column), cell in drawn.get_celld().items():
        cell.set_linewidth(0.5)
        of_block = column < 0 and names[line - 1] in _MANNERS.values()
        if of_block or line in (0, len(names)):
            cell.set_text_props(weight='bold')
        if of_block:
            cell.set_text_props(ha='left')


def _cell(s: Mapping[str, float]) -> str:
    return f'{s["success"]:.2f} ({s["predicted"]:.2f})\n[{s["low"]:.2f}, {s["high"]:.2f}]'


def _printed(success: float | None) -> str:
    return '' if success is None else f' {{{success:.4f}}}'


def _reliability(axes: Axes, calibration: Mapping[str, Any]) -> None:
    axes.plot([0, 1], [0, 1], color='black', linewidth=0.8)
    cells = calibration['cells']
    names = dict.fromkeys(cell['object'] for cell in cells)
    for name, colour in zip(names, cycle(_COLOURS), strict=False):
        mine = [cell for cell in cells if cell['object'] == name]
        axes.scatter(
            [cell['predicted'] for cell in mine], [cell['achieved'] for cell in mine],
            s=[8 + 1.2 * cell['n'] for cell in mine], color=colour, alpha=0.6,
            linewidths=0, label=name,
        )  # fmt: skip
    axes.set(
        xlabel='success predicted', ylabel='success achieved', aspect='equal',
        xlim=(-0.03, 1.03), ylim=(-0.03, 1.03),
    )  # fmt: skip
    axes.set_title(
        'Actions by object and change (area: tries)\n'
        f'expected calibration error {calibration["expected_calibration_error"]:.3f}',
        fontsize=10,
    )
    axes.legend(frameon=False, loc='lower right', fontsize=9)
    axes.spines[['top', 'right']].set_visible(False)


def _means(axes: Axes, averages: Mapping[str, Any]) -> None:
    for place, approach in enumerate(Approach):
        s = averages[approach]
        reach = [[s['success'] - s['low']], [s['high'] - s['success']]]
        label = ('executed', 'predicted', 'asks for help') if place == 0 else (None,) * 3
        axes.bar(
            place, s['success'], 0.55, yerr=reach, color='#4477aa', label=label[0],
            error_kw={'elinewidth': 1},
        )  # fmt: skip
        axes.plot(place, s['predicted'], 'D', color='#ee8866', label=label[1])
        if approach.helped or place == 0:
            shown = s['help_rate'] if approach.helped else float('nan')
            axes.bar(place + 0.36, shown, 0.12, color='#bbbbbb', label=label[2])
    axes.set_xticks(range(len(Approach)), list(_HEADINGS.values()), fontsize=8)
    axes.set_ylim(0, 1.2)
    axes.set_yticks([0, 0.2, 0.4, 0.6, 0.8, 1])
    axes.set_title('Means over objects, changes and demonstrations', fontsize=10)
    axes.legend(frameon=False, fontsize=8, loc='upper left', ncols=3)
    axes.spines[['top', 'right']].set_visible(False)
