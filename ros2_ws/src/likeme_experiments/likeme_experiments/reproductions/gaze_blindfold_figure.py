"""Figure 6's right half: the model's looking scores, with the groups the paper does not model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np

# There is no display.
mpl.use('Agg')

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from likeme_experiments.reproductions.text_table import footnote

COLOURS = {'30': '#2f5fd0', '35': '#9db7ef'}


def draw_scores(document: Mapping[str, Any]) -> Figure:
    """Mean looking score and standard error of every group, at both thresholds."""
    groups = document['groups']
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(10.5, 4.2), sharey=True, layout='constrained'
    )
    _bars(left, groups[:3], '12 months, by self-experience (Fig 6)')
    _bars(right, groups[3:], '18 months (mentioned in the paper)')
    left.set_ylabel(f'looking score of {document["agents_per_group"]} agents')
    left.set_ylim(-0.9, 4.4)
    right.legend(title='turn of at least', loc='upper left', fontsize=9, framealpha=1)
    footnote(figure, document['paper'])
    plt.close(figure)
    return figure


def _bars(axes: Axes, groups: Sequence[Mapping[str, Any]], title: str) -> None:
    places = np.arange(len(groups))
    for shift, threshold in ((-0.2, '30'), (0.2, '35')):
        scores = [group['scores'][threshold] for group in groups]
        axes.bar(
            places + shift,
            [score['mean'] for score in scores],
            0.38,
            yerr=[score['standard_error'] for score in scores],
            color=COLOURS[threshold],
            capsize=4,
            label=f'{threshold}°',
        )
    for place, group in zip(places, groups, strict=True):
        does = 'infants follow' if group['infants_follow'] else 'infants do not'
        axes.text(float(place), -0.72, does, ha='center', fontsize=9, style='italic')
    axes.axhline(0, color='black', lw=0.8)
    axes.set_xticks(places, [group['name'].removeprefix('18 months, ') for group in groups])
    axes.set_title(title, fontsize=11)
    axes.spines[['top', 'right']].set_visible(False)
