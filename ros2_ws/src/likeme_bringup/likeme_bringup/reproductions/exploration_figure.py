"""Help rate against trials as curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from likeme_inference.experiments.exploration import Curve, Way

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = {Way.UNIFORM: 'tab:gray', Way.SYSTEMATIC: 'tab:blue', Way.INFORMATION_GAIN: 'tab:red'}
_DASHES = {'maximum likelihood': ':', 'Dirichlet': '--', 'shared prior': '-'}


def curves_figure(
    title: str, trials: Sequence[int], curves: Sequence[Curve], known: float
) -> Figure:
    """One curve for each policy (colour) and estimate (dashes), with standard errors."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 4.5), layout='constrained')
    axes = figure.add_subplot()
    for curve in curves:
        axes.errorbar(
            trials,
            100 * curve.mean,
            yerr=100 * curve.error,
            color=_COLOURS[curve.way],
            linestyle=_DASHES[curve.estimate],
            label=f'{curve.way.value}, {curve.estimate}',
        )
    axes.axhline(100 * known, color='black', linewidth=0.8, label='knowing the world')
    axes.set(xlabel='trials in all', ylabel='help rate, %', title=title)
    axes.set_ylim(bottom=0)
    axes.spines[['top', 'right']].set_visible(False)
    axes.legend(fontsize='small', frameon=False)
    return figure
