"""Figures of the posterior, the predictive checks and the sensitivity to the prior."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from likeme_core.world import World
from likeme_experiments.evaluation.decision_draws import DecisionDraws
from likeme_experiments.evaluation.predictive_checks import ModelCheck
from likeme_experiments.reproductions.tabletop_figures import (
    COLOURS,
    colour_of,
    short_actions,
    short_states,
)
from likeme_experiments.reproductions.text_table import footnote, short
from likeme_inference.tabletop.posterior_sampling import PosteriorDraws
from likeme_inference.tabletop.sensitivity import (
    NO_ACTION,
    PriorSensitivity,
    ShownChange,
    TurningPoint,
)

RED = '#cc3311'


def decision_draws(rows: Sequence[DecisionDraws], world: World) -> Figure:
    """Intervals of P(G = x_f) and shares of draws that decide as maximum likelihood does."""
    figure = Figure(figsize=(9.5, 1.4 + 0.32 * len(rows)), layout='constrained')
    left, right = figure.subplots(1, 2, sharey=True)
    places = np.arange(len(rows))
    mean = np.array([row.mean for row in rows])
    reach = [mean - [row.low for row in rows], [row.high for row in rows] - mean]
    colours = [colour_of(world.states[row.change.x_f]) for row in rows]
    left.hlines(places, mean - reach[0], mean + reach[1], color=colours, linewidth=4)
    left.plot(mean, places, 'o', color='black', label='mean over draws')
    left.plot([row.reference for row in rows], places, '|', color=RED, markersize=14,
              markeredgewidth=2, label='maximum likelihood (the paper)')  # fmt: skip
    left.set_yticks(places, [_change(row.change, world) for row in rows])
    left.invert_yaxis()
    left.set(xlabel='$P(G = x_f\\,|\\,x_i, x_f)$, 95 % bounds', xlim=(0, 1.02))
    for name, label, marker, shift in (
        ('same_goal', 'goal', 's', -0.2),
        ('same_action', 'action', 'D', 0.0),
        ('same_asking', 'asking', '^', 0.2),
    ):
        shares = [getattr(row, name) for row in rows]
        right.plot(shares, places + shift, marker, label=label)
    right.set(xlabel='share of draws that agree with maximum likelihood', xlim=(0, 1.02))
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.legend(loc='lower left', fontsize=8)
        _bare(axes)
    return figure


def predictive_checks(checks: Sequence[ModelCheck], draws: PosteriorDraws, world: World) -> Figure:
    """Observed and replicated successes of each row; the p of each check against uniform ones."""
    tall = 0.5 + 1.35 * len(draws.objects)
    figure = Figure(figsize=(11.0, tall + 3.2), layout='constrained')
    above, below = figure.subfigures(2, 1, squeeze=False, height_ratios=(tall, 3.0))[:, 0]
    above.suptitle(
        '(a) Trials that ended in the state the action is aimed at (dots), and 95 % of those '
        'made again from the posterior, which has seen them',
        fontsize=10,
    )
    within = [x for x in world.states if x not in world.out_of_reach]
    size = len(draws.objects), len(within)
    grid = above.subplots(*size, sharex=True, sharey=True, squeeze=False)
    for o, row in enumerate(grid):
        for axes, x_i in zip(row, within, strict=True):
            _replicated(axes, draws, o, x_i, world)
        row[0].set_ylabel(f'{draws.objects[o]}\nshare')
    for axes, x_i in zip(grid[0], within, strict=True):
        axes.set_title(f'$x_i$ = {x_i.name}', fontsize=9)
    below.suptitle(
        '(b) The p of all rows, in order: on the line they are as chance has them, '
        'below it they are too small',
        fontsize=10,
    )
    panels = below.subplots(1, len(checks), sharey=True, squeeze=False)[0]
    for axes, check in zip(panels, checks, strict=True):
        _quantiles(axes, check)
    panels[0].set_ylabel('p of a row')
    footnote(
        figure,
        '. '.join(f'{check.name}: {check.about}' for check in checks)
        + '. Rows with few possible outcomes have a p near 1. Red: below .05 after '
        "Holm's correction.",
    )
    return figure


def _replicated(axes: Axes, draws: PosteriorDraws, o: int, x_i: int, world: World) -> None:
    trials = np.maximum(1, draws.observed[o, x_i].sum(axis=-1))
    places, aims = np.arange(len(world.actions)), [a.target for a in world.actions]
    made = draws.posterior.counts[:, :, o, x_i, places, aims] / trials
    low, middle, high = np.quantile(made, [0.025, 0.5, 0.975], axis=(0, 1))
    axes.vlines(places, low, high, color=[colour_of(s) for s in aims], linewidth=5, alpha=0.5)
    axes.plot(places, middle, '_', color='black')
    seen = draws.observed[o, x_i, places, aims] / trials
    axes.plot(places, seen, 'o', color='black', markersize=4)
    axes.set_xticks(places, short_actions(world), fontsize=7)
    axes.set_ylim(-0.03, 1.03)
    _bare(axes)


def _quantiles(axes: Axes, check: ModelCheck) -> None:
    kept = np.isfinite(check.p)
    order = np.argsort(check.p[kept])
    p, corrected = check.p[kept][order], check.corrected[kept][order]
    expected = (np.arange(len(p)) + 0.5) / max(1, len(p))
    axes.plot([0, 1], [0, 1], color='#999999', linewidth=1)
    axes.scatter(expected, p, s=14, color=np.where(corrected < 0.05, RED, COLOURS[0]))
    twice = '\nuses the trials twice' if check.twice else ''
    axes.set_title(f'{check.name}: overall p = {check.overall:.3g}{twice}', fontsize=9)
    axes.set(xlabel='uniform', xlim=(0, 1), ylim=(-0.02, 1.02), aspect='equal')
    _bare(axes)


def prior_sensitivity(
    found: PriorSensitivity, turning: Sequence[TurningPoint], world: World, threshold: float
) -> Figure:
    """Demonstrations by priors: predicted success, the action, and where decisions change."""
    rows, columns = len(found.changes), len(found.settings)
    figure = Figure(figsize=(2.6 + 0.72 * columns, 2.2 + 0.5 * rows), layout='constrained')
    upper, lower = figure.subplots(2, 1)
    shown = [change.x_f for change in found.changes]
    belief = found.posterior[:, np.arange(rows), shown].T
    short_names, states = short_actions(world), short_states(world)
    for axes, values, title in (
        (upper, belief, '(a) $P(G = x_f\\,|\\,x_i, x_f)$; a letter: the MAP goal, if another'),
        (
            lower,
            found.success.T,
            f'(b) predicted success of the best action; *: below {threshold:g}, asks',
        ),
    ):
        axes.imshow(values, vmin=0, vmax=1, cmap='cividis', aspect='auto')
        axes.set_title(title, fontsize=10, loc='left')
        axes.set_yticks(range(rows), [_change(change, world) for change in found.changes])
        axes.set_xticks(range(columns), [setting.label for setting in found.settings])
        axes.tick_params(labelsize=8)
    for c in range(rows):
        for s in range(columns):
            goal, action = found.goal[s, c], found.action[s, c]
            other = f' {states[goal]}' if goal != shown[c] else ''
            _cell(upper, s, c, short(belief[c, s]) + other, belief[c, s])
            told = '-'
            if action != NO_ACTION:
                star = '*' if found.asks[s, c] else ''
                told = f'{short_names[action]} {short(found.success[s, c])}{star}'
            _cell(lower, s, c, told, found.success[s, c])
    _boundaries(upper, (found.goal != found.goal[:1]).T)
    _boundaries(lower, found.differs.T)
    turns = [turn.concentration for turn in turning if turn.what]
    least = f' The least concentration that changes one: {min(turns):.2g}.' if turns else ''
    footnote(
        figure,
        'ML: maximum likelihood, the paper; numbers: Dirichlet pseudo-counts of each final state; '
        'shared, structured: fitted to all objects. Red frames: another goal, another action or '
        f'another answer to whether to ask than with ML.{least}',
    )
    return figure


def _cell(axes: Axes, column: int, row: int, text: str, value: float) -> None:
    dark = np.isfinite(value) and value < 0.5
    axes.text(column, row, text, ha='center', va='center', fontsize=7.5,
              color='white' if dark else 'black')  # fmt: skip


def _boundaries(axes: Axes, differs: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> None:
    """A frame around each group of cells that differ, shape [row, column]."""
    padded = np.pad(differs, 1)
    for row, column in zip(*np.nonzero(differs), strict=True):
        for down, right, line in (
            (-1, 0, ([-0.5, 0.5], [-0.5, -0.5])),
            (1, 0, ([-0.5, 0.5], [0.5, 0.5])),
            (0, -1, ([-0.5, -0.5], [-0.5, 0.5])),
            (0, 1, ([0.5, 0.5], [-0.5, 0.5])),
        ):
            if not padded[row + 1 + down, column + 1 + right]:
                xs, ys = line
                axes.plot([column + x for x in xs], [row + y for y in ys], color=RED, linewidth=2)


def _change(change: ShownChange, world: World) -> str:
    x_i, x_f = (world.states[x].name for x in (change.x_i, change.x_f))
    return f'{change.object}, {x_i} → {x_f}'


def _bare(axes: Axes) -> None:
    axes.spines[['top', 'right']].set_visible(False)
