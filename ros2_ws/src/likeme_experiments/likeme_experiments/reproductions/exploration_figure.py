"""Help rate against trials as curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from likeme_experiments.evaluation.exploration import ExplorationStrategy, HelpRateCurve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = {
    ExplorationStrategy.UNIFORM: 'tab:gray',
    ExplorationStrategy.SYSTEMATIC: 'tab:blue',
    ExplorationStrategy.INFORMATION_GAIN: 'tab:red',
}
_DASHES = {'maximum likelihood': ':', 'Dirichlet': '--', 'shared prior': '-'}


def curves_figure(
    worlds: Mapping[str, tuple[Sequence[HelpRateCurve], float]], trials: Sequence[int]
) -> Figure:
    """A panel for each world, by its title: its curves, and the help rate in a known world."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5 * len(worlds), 4.5), layout='constrained')
    panels = figure.subplots(1, len(worlds), sharey=True, squeeze=False)[0]
    for axes, (title, (curves, known)) in zip(panels, worlds.items(), strict=True):
        _panel(axes, title, trials, curves, known)
    panels[0].set_ylabel('help rate, %')
    panels[-1].legend(fontsize='small', frameon=False)
    return figure


def _panel(
    axes: Axes, title: str, trials: Sequence[int], curves: Sequence[HelpRateCurve], known: float
) -> None:
    """One curve for each policy (colour) and estimate (dashes), with standard errors."""
    for curve in curves:
        axes.errorbar(
            trials,
            100 * curve.mean,
            yerr=100 * curve.error,
            color=_COLOURS[curve.policy],
            linestyle=_DASHES[curve.estimate],
            label=f'{curve.policy.value}, {curve.estimate}',
        )
    axes.axhline(100 * known, color='black', linewidth=0.8, label='knowing the world')
    axes.set(xlabel='trials in all', title=f'World: {title}')
    axes.set_ylim(bottom=0)
    axes.spines[['top', 'right']].set_visible(False)
