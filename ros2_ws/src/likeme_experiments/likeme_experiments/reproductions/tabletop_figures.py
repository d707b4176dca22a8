"""The tabletop's tables and figures, laid out as in the paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from likeme_core.tabletop import Manner, State
from likeme_core.world import World
from likeme_experiments.evaluation.demonstrations import changes_of
from likeme_experiments.evaluation.fig7 import TransitionBars
from likeme_experiments.evaluation.fig8 import Fig8Column
from likeme_experiments.evaluation.practice import Convergence
from likeme_experiments.evaluation.sequential import SequentialRow
from likeme_experiments.evaluation.table1 import MANNER_NAMES, MODES, PAPER, Table1
from likeme_experiments.reproductions.text_table import footnote

#: Of the states in their order; distinct for colour-blind readers.
COLOURS = ('#4477aa', '#ee8866', '#999999', '#228833', '#ccbb44', '#aa3377', '#66ccee')
#: Share of the distance between two actions that the bars of one take.
BARS, GAPS = 0.75, 0.81
MODE_NAMES = ('Trajectory', 'Goal-Based', 'Interactive\nGoal-Based')


def table1(result: Table1, papers: bool) -> Figure:
    """The table; row-wise highest bold, improved by asking italic, as in the paper.

    papers: whether the world is the paper's, whose printed values are then shown.
    """
    lines = (1 + len(result.objects)) * len(result.manners)
    figure = Figure(figsize=(7.2, 1.0 + 0.45 * lines), layout='constrained')
    axes = figure.subplots()
    axes.set_axis_off()
    cells, rows = [], []
    printed = False
    for m, manner in enumerate(result.manners):
        rows.append(MANNER_NAMES[manner])
        cells.append([''] * len(MODES))
        for o, name in enumerate(result.objects):
            paper = PAPER.get((manner, name)) if papers else None
            printed = printed or paper is not None
            rows.append(f'{name.capitalize()}  ')
            cells.append(
                [
                    f'{value:.4f}' + ('' if paper is None else f'  ({paper[k]:.4f})')
                    for k, value in enumerate(result.success[m, o])
                ]
            )
    drawn = axes.table(cells, rowLabels=rows, colLabels=MODE_NAMES, loc='center', cellLoc='center')
    drawn.auto_set_font_size(False)
    drawn.set_fontsize(10)
    drawn.scale(1, 1.9)
    _style_table1(drawn, result)
    brackets = ' (in brackets: as printed)' if printed else ''
    misprint = ' 0.7250 is a misprint: the rule gives 0.8250.' if printed else ''
    figure.suptitle(f'Table 1. Comparison of approaches{brackets}', fontsize=11)
    figure.supxlabel(
        f'Bold: highest of the row. Italic: improved by asking.{misprint}', fontsize=8
    )
    return figure


def _style_table1(drawn: object, result: Table1) -> None:
    line = 1
    cells = drawn.get_celld()  # type: ignore[attr-defined]
    for (_, _), cell in cells.items():
        cell.set_linewidth(0.5)
    for m in range(len(result.manners)):
        cells[line, -1].set_text_props(weight='bold', ha='left')
        line += 1
        for values in result.success[m]:
            for k, value in enumerate(values):
                bold = 'bold' if np.isclose(value, values.max()) else 'normal'
                italic = 'italic' if k == 2 and value > values[1] + 1e-9 else 'normal'
                cells[line, k].set_text_props(weight=bold, style=italic)
            line += 1


def fig7(series: Mapping[str, Sequence[TransitionBars]], world: World, note: str = '') -> Figure:
    """Objects by initial states; for each action one bar a final state.

    series: name of a robot -> its bars; several robots are drawn side by side.
    note: sentences below.
    """
    every = [bar for bars in series.values() for bar in bars]
    objects = list(dict.fromkeys(bar.object for bar in every))
    states = [state for state in world.states if state not in world.out_of_reach]
    columns = [(robot, x_i) for robot in series for x_i in states]
    wide = 3.875 * max(1.0, len(world.actions) * len(world.states) / 18)
    size = 1.25 + wide * len(columns), 2.3 * len(objects) + 0.7
    figure = Figure(figsize=size, layout='constrained')
    grid = figure.subplots(len(objects), len(columns), sharey=True, squeeze=False)
    for row, name in zip(grid, objects, strict=True):
        for axes, (robot, x_i) in zip(row, columns, strict=True):
            shown = [bar for bar in series[robot] if (bar.object, bar.x_i) == (name, x_i)]
            _transition_bars(axes, shown, world)
            whose = f'{robot}\n' if len(series) > 1 else ''
            title = f'{whose}$X_i$ = {x_i.name}' if name == objects[0] else ''
            axes.set_title(title, fontsize=11)
        row[0].set_ylabel(f'{name.capitalize()}\n$P(X_f\\,|\\,X_i, A)$')
    handles = [grid[0, 0].containers[2 * k + 1] for k in range(len(world.states))]
    figure.legend(
        handles,
        [f'$X_f$ = {s.name}' for s in world.states],
        loc='outside upper center',
        ncols=len(world.states),
    )
    if note:
        footnote(figure, note)
    return figure


def colour_of(state: State) -> str:
    """The colour of a state's bars."""
    return COLOURS[state % len(COLOURS)]


def short_states(world: World) -> list[str]:
    """The shortest beginnings of the states' names that tell them apart."""
    names = [state.name for state in world.states]
    length = next(n for n in range(1, 41) if len({name[:n] for name in names}) == len(names))
    return [name[:length] for name in names]


def short_actions(world: World) -> list[str]:
    """A letter of the manner and the short name of the target: PL for PLACE_LEFT."""
    letters: dict[Manner, str] = {}
    for manner in Manner:
        letters[manner] = next(c for c in manner.name if c not in letters.values())
    states = short_states(world)
    return [letters[action.manner] + states[action.target] for action in world.actions]


def _transition_bars(axes: Axes, shown: Sequence[TransitionBars], world: World) -> None:
    places, count = np.arange(len(shown)), len(world.states)
    for state in world.states:
        p = np.array([bar.probability[state] for bar in shown])
        reach = [
            p - np.array([bar.low[state] for bar in shown]),
            np.array([bar.high[state] for bar in shown]) - p,
        ]
        axes.bar(
            places + GAPS / count * (state - (count - 1) / 2), p, BARS / count,
            color=colour_of(state),
            yerr=np.maximum(reach, 0), error_kw={'elinewidth': 0.8, 'ecolor': '#333333'},
        )  # fmt: skip
    short = short_actions(world)
    axes.set_xticks(places, [short[bar.action] for bar in shown])
    axes.set_ylim(0, 1.05)
    _bare(axes)


def fig8(
    cases: Sequence[Fig8Column], world: World, threshold: float, notes: Sequence[str] = ()
) -> Figure:
    """Three blocks of objects by changes: goals, actions, predictions.

    notes: a sentence below each block.
    """
    objects, changes = list(dict.fromkeys(case.object for case in cases)), changes_of(world)
    size = 9.5 * max(1.0, len(changes) / 4), 13.5 * max(1.0, len(objects) / 3)
    figure = Figure(figsize=size, layout='constrained')
    blocks: Any = figure.subfigures(3, 1, hspace=0.04, height_ratios=(1, 1.05, 0.9))
    drawn: tuple[tuple[str, Callable[[Axes, Fig8Column], None]], ...] = (
        ('(a) Most likely goals  $P(G\\,|\\,x_i, x_f)$', partial(_goal_bars, world=world)),
        ('(b) Inferring actions  $P(A\\,|\\,x_i, g)$', partial(_action_bars, world=world)),
        (
            '(c) Predicting final state  $P(X_f = g\\,|\\,x_i, a_{MAP})$',
            partial(_prediction_bar, world=world, threshold=threshold),
        ),
    )
    for block, (title, draw) in zip(blocks, drawn, strict=True):
        block.suptitle(title, x=0.01, ha='left', fontsize=12, fontweight='bold')
        grid = block.subplots(len(objects), len(changes), sharey=True, squeeze=False)
        for k, case in enumerate(cases):
            axes = grid[k // len(changes), k % len(changes)]
            draw(axes, case)
            axes.set_ylim(0, 1.18)
            axes.set_yticks([0, 0.5, 1])
            _bare(axes)
            if k < len(changes):
                axes.set_title(f'{case.x_i.name} → {case.x_f.name}', fontsize=10)
            if k % len(changes) == 0:
                axes.set_ylabel(case.object.capitalize())
    for block, note in zip(blocks, notes, strict=False):
        block.supxlabel(note, fontsize=9)
    return figure


def _goal_bars(axes: Axes, case: Fig8Column, world: World) -> None:
    colours = [colour_of(state) for state in world.states]
    axes.bar(range(len(colours)), case.goal_posterior, 0.6, color=colours)
    axes.text(case.x_f, case.goal_posterior[case.x_f], '*', ha='center', fontsize=14)
    axes.set_xticks(range(len(colours)), short_states(world))


def _action_bars(axes: Axes, case: Fig8Column, world: World) -> None:
    colours = [colour_of(action.target) for action in world.actions]
    axes.bar(range(len(colours)), case.action_posterior, 0.7, color=colours)
    if case.action is not None:
        height = case.action_posterior[case.action]
        axes.text(case.action, height, '*', ha='center', fontsize=14)
    axes.set_xticks(range(len(colours)), short_actions(world), fontsize=8)


def _prediction_bar(axes: Axes, case: Fig8Column, world: World, threshold: float) -> None:
    if case.action is not None:
        axes.bar([0], [case.predicted_success], 0.5, color=colour_of(case.goal))
        asks = '  asks' if case.asks else ''
        axes.text(0.3, 0.06, f'{case.predicted_success:.2f}{asks}', fontsize=9)
        axes.set_xticks([0], [short_actions(world)[case.action]])
    axes.axhline(threshold, color='#cc3311', linewidth=1.5)
    axes.set_xlim(-0.6, 1.0)


def sequential(rows: Sequence[SequentialRow]) -> Figure:
    """Success without asking against the number of actions, by object."""
    figure = Figure(figsize=(6.2, 4.0), layout='constrained')
    axes = figure.subplots()
    budgets = list(dict.fromkeys(row.actions for row in rows))
    objects = list(dict.fromkeys(row.object for row in rows))
    for name, colour in zip(objects, ('#228833', '#ccbb44', '#aa3377', *COLOURS), strict=False):
        mine = [row.success for row in rows if row.object == name]
        axes.plot(budgets, mine, 'o-', label=name, color=colour, linewidth=1.3)
    mean = [np.mean([row.success for row in rows if row.actions == n]) for n in budgets]
    axes.plot(budgets, mean, 's--', color='black', label='mean')
    axes.set_xlabel('actions the robot may take, looking after each')
    axes.set_ylabel('P(goal reached without asking)')
    axes.set_xticks(budgets)
    axes.set_ylim(None, 1.005)
    axes.grid(alpha=0.3)
    axes.legend()
    return figure


def practice(result: Convergence) -> Figure:
    """Distance from the limit against rounds; dashed: of the mean policy."""
    figure = Figure(figsize=(6.2, 4.0), layout='constrained')
    axes = figure.subplots()
    for step, gap, mean_gap, colour in zip(
        result.steps, result.distance, result.of_mean, COLOURS, strict=False
    ):
        axes.plot(gap, color=colour, label=f'step {step:g}')
        axes.plot(mean_gap, '--', color=colour, linewidth=1)
    axes.set_xlabel('rounds of practice (one action for each goal and state)')
    axes.set_ylabel('distance of $P(A\\,|\\,g, x_i)$ from its limit')
    axes.set_xscale('symlog', linthresh=10)
    axes.set_ylim(0, None)
    axes.legend(title='dashed: mean policy')
    return figure


def _bare(axes: Axes) -> None:
    axes.spines[['top', 'right']].set_visible(False)
