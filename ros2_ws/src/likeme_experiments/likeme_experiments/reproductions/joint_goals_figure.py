"""Joint goals and the failed-attempt experiment as figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from likeme_experiments.evaluation.failed_attempt import Agent, FailedAttempt, Group

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from likeme_experiments.evaluation.joint_goals import Accuracy
    from likeme_experiments.evaluation.people import Kind

_COLOURS = ('#4477aa', '#bbbbbb', '#ee8866')
_SHOWN = {
    Group.TARGET: 'reaches the state',
    Group.ATTEMPT: 'tries in vain',
    Group.CONTROL: 'handles it otherwise',
}


def joint(found: Mapping[Kind, tuple[Accuracy, Accuracy]]) -> Figure:
    """Share of goals inferred right by kind of people: during the demonstration, after it."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 4.2), layout='constrained')
    panels = figure.subplots(1, 2, sharey=True)
    names = ('joint, rationality inferred', 'joint, told the rationality', 'act by act (Fig 3d)')
    for k, (axes, when) in enumerate(
        zip(panels, ('after 3/4 of the acts', 'after the person stopped'), strict=True)
    ):
        shares = np.array([both[k][1:] for both in found.values()])  # [kind, way]
        _grouped(axes, shares, list(found), names)
        axes.set_title(when)
    panels[0].set_ylabel('share of goals inferred right')
    figure.legend(*panels[0].get_legend_handles_labels(), loc='outside lower center', ncols=3)
    n = next(iter(found.values()))[0].n
    figure.suptitle(f'Goals over the whole table, {n} demonstrations of each kind of people')
    return figure


def failed_attempt(result: FailedAttempt) -> Figure:
    """What was meant, as it is inferred act by act; and what each agent then achieves."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.5, 4.0), layout='constrained')
    course, success = figure.subplots(1, 2)
    for group, colour in zip(Group, ('#228833', '#4477aa', '#999999'), strict=True):
        belief = result.belief[group]
        course.plot(belief[:-1], 'o-', color=colour, label=f'the person {_SHOWN[group]}')
        last = len(belief) - 2
        course.plot([last, last + 0.5], belief[-2:], 's:', color=colour, markevery=[1])
    course.set_xticks(range(len(result.belief[Group.ATTEMPT]) - 1))
    course.set_xlabel('acts seen (square: the person has stopped)')
    course.set_ylabel('P(the state is the goal of the object)')
    course.set_ylim(0, 1)
    course.legend(fontsize='small')
    shares = np.array([[result.success[g][a] for a in Agent] for g in Group])
    names = [f'the agent {agent}' for agent in Agent]
    _grouped(success, shares, [_SHOWN[group] for group in Group], names, turn=False)
    success.set_ylabel('P(the agent brings the object there)')
    success.legend(fontsize='small')
    figure.suptitle(f'A failed attempt (Meltzoff 1995): mean of {result.cases} demonstrations')
    return figure


def _grouped(
    axes: Axes, shares: np.ndarray, groups: list[str], names: list[str] | tuple[str, ...],
    turn: bool = True,
) -> None:  # fmt: skip
    """Bars side by side; shares: shape [group, bar], groups and names: their labels."""
    at, width = np.arange(len(groups)), 0.8 / len(names)
    for k, (name, colour) in enumerate(zip(names, _COLOURS, strict=True)):
        axes.bar(at + (k - 1) * width, shares[:, k], width, color=colour, label=name)
    axes.set_xticks(at, groups, rotation=30 if turn else 0)
    axes.set_ylim(0, 1)
    axes.spines[['top', 'right']].set_visible(False)
