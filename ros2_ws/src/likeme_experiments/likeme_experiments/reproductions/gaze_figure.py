"""Figures 4 and 5, laid out as in the paper."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np

# There is no display.
mpl.use('Agg')

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from likeme_experiments.evaluation.gaze_accuracy import INSIDE_95, GazeErrors
from likeme_experiments.evaluation.gaze_scene import GazeScene
from likeme_experiments.reproductions.paper_statements import FIG_4, FIG_5
from likeme_experiments.reproductions.text_table import footnote
from likeme_gaze.beliefs import Gaussian
from likeme_gaze.frames import Pose2

TRUE, INFERRED = '#2f5fd0', '#d03535'
ARROW = 130.0
#: Which of the scene's goals the arrows belong to.
SHOWN = -1


def draw_scene(scene: GazeScene) -> Figure:
    """Agent and mentor from above, true goals in blue and inferred ones in red (Fig 4)."""
    figure, axes = plt.subplots(figsize=(7.0, 7.4), layout='constrained')
    goal, found = scene.test.goal, scene.inferred
    for k in range(len(goal)):
        axes.add_patch(region_95(Gaussian(found.mean[k], found.covariance[k])))
    axes.plot(*goal.T, 'o', color=TRUE, ms=8, label='true goal')
    axes.plot(*found.mean.T, 'o', color=INFERRED, ms=6, label='inferred goal, 95 % region')
    people = (
        ('agent', scene.setting.agent, scene.test.agent_start, scene.agent_final),
        ('mentor', scene.setting.mentor, scene.test.mentor_start, scene.test.final[-1, :, 0]),
    )
    for name, frame, start, final in people:
        axes.plot(frame.x, frame.y, 's', color='black', ms=13)
        axes.annotate(
            name,
            (frame.x, frame.y),
            (0, -22),
            textcoords='offset points',
            ha='center',
            fontsize=12,
        )
        _arrow(axes, frame, float(start[SHOWN]), 'initial gaze')
        _arrow(axes, frame, float(final[SHOWN]), 'final gaze')
    axes.plot(*goal[SHOWN], 'o', color='none', mec='black', ms=15, mew=1.2)
    axes.set(xlabel='x (cm)', ylabel='y (cm)', xlim=(-90, 690), ylim=(-480, 480), aspect='equal')
    axes.set_title(
        'Gaze following from five observations\n(arrows: the circled goal)', fontsize=12
    )
    axes.legend(loc='upper right', fontsize=9, framealpha=0.95)
    footnote(figure, FIG_4)
    plt.close(figure)
    return figure


def draw_histograms(errors: Sequence[GazeErrors]) -> Figure:
    """Probability of an error in degrees for each of the three inferences (Fig 5)."""
    figure, panels = plt.subplots(1, 3, figsize=(12.0, 3.8), sharey=True, layout='constrained')
    data = (
        ('(a) Forward inference', [each.forward for each in errors]),
        ('(b) Reverse inference', [each.reverse[-1] for each in errors]),
        ('(c) Gaze following', [each.following[-1] for each in errors]),
    )
    edges = np.arange(-10.5, 11.5, 1.0)
    for axes, (title, parts) in zip(panels, data, strict=True):
        error = np.concatenate(parts)
        inside = np.clip(error, edges[0], edges[-1])
        axes.hist(inside, edges, weights=np.full(len(error), 1 / len(error)), color=TRUE, ec='w')
        size = np.abs(error)
        words = f'|error|\nmedian {np.median(size):.2f}°\n90 %  {np.quantile(size, 0.9):.2f}°'
        axes.text(0.97, 0.95, words, transform=axes.transAxes, ha='right', va='top', fontsize=11)
        axes.set(title=title, xlabel='error (degrees)', xticks=range(-10, 11, 5))
        axes.spines[['top', 'right']].set_visible(False)
    panels[0].set_ylabel('probability')
    footnote(figure, FIG_5)
    plt.close(figure)
    return figure


def region_95(belief: Gaussian) -> Ellipse:
    """The 95 % region of a Gaussian in the plane."""
    variances, directions = np.linalg.eigh(belief.covariance)
    long, short = 2 * np.sqrt(INSIDE_95 * variances[::-1])
    angle = np.degrees(np.arctan2(directions[1, 1], directions[0, 1]))
    return Ellipse(
        (belief.mean[0], belief.mean[1]),
        long,
        short,
        angle=float(angle),
        fc='#d0353522',
        ec=INFERRED,
    )


def _arrow(axes: Axes, frame: Pose2, heading: float, words: str) -> None:
    """A gaze vector with its name at its tip."""
    direction = frame.heading + heading
    ahead = np.array([np.cos(direction), np.sin(direction)])
    tip = np.array([frame.x, frame.y]) + ARROW * ahead
    style = {'arrowstyle': '-|>', 'lw': 1.8, 'color': 'black', 'shrinkA': 8, 'shrinkB': 0}
    axes.annotate('', (tip[0], tip[1]), (frame.x, frame.y), arrowprops=style)
    place = tip + 12 * ahead
    axes.text(
        place[0], place[1], words, fontsize=9, ha='center', va='bottom' if ahead[1] >= 0 else 'top'
    )
