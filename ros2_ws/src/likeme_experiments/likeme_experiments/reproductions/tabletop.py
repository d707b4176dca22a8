"""Table 1, Fig 7, Fig 8, several actions, and goal-based exploration."""

from __future__ import annotations

from itertools import zip_longest
from typing import Any

import numpy as np

from likeme_core.tabletop import Manner
from likeme_core.world import World
from likeme_experiments.evaluation.fig7 import TransitionBars, fig7
from likeme_experiments.evaluation.fig8 import Fig8Column, fig8
from likeme_experiments.evaluation.practice import practice
from likeme_experiments.evaluation.sequential import SequentialRow, sequential
from likeme_experiments.evaluation.table1 import MISPRINT, MODES, PAPER, Table1, table1
from likeme_experiments.reproductions import tabletop_figures as figures
from likeme_experiments.reproductions.fig8_statements import PAPER as PAPER_ON_FIG8
from likeme_experiments.reproductions.fig8_statements import STATED, statements_of
from likeme_experiments.reproductions.models import model_of
from likeme_experiments.reproductions.paper_statements import FIG_7
from likeme_experiments.reproductions.report import (
    Reproduction,
    ReproductionOptions,
    ReproductionReport,
)
from likeme_experiments.reproductions.text_table import aligned, paragraph, short
from likeme_inference.tabletop import model_file
from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.robot_model import RobotModel

THRESHOLD = 0.5
#: Options of every reproduction of this file; workers are for `--model learned`.
TAKES = frozenset({'world', 'model', 'workers'})


def report_table1(options: ReproductionOptions) -> ReproductionReport:
    """Table 1."""
    model = model_of(options)
    result = table1(model, options.world, THRESHOLD)
    rows = [
        {
            'demonstration': manner.name.lower(),
            'object': name,
            **dict(zip(map(str, MODES), result.success[m, o].tolist(), strict=True)),
            'paper': _printed(model, manner, name),
        }
        for m, manner in enumerate(result.manners)
        for o, name in enumerate(result.objects)
    ]
    document = {'model': model.label, 'threshold': THRESHOLD, 'rows': rows}
    return ReproductionReport(
        document,
        _table1_text(model, result),
        lambda: figures.table1(result, model.domain == TABLETOP),
    )


def _paper(model: RobotModel, manner: Manner, name: str) -> tuple[float, ...]:
    """What the paper prints for a model in its world; empty for another."""
    return PAPER.get((manner, name), ()) if model.domain == TABLETOP else ()


def _printed(model: RobotModel, manner: Manner, name: str) -> dict[str, float] | None:
    values = _paper(model, manner, name)
    return dict(zip(map(str, MODES), values, strict=True)) if values else None


def _table1_text(model: RobotModel, result: Table1) -> str:
    beside_it = '; in brackets as the paper prints it' if model.domain == TABLETOP else ''
    table = [['shown by', 'object', *(f'{mode} ' for mode in MODES)]]
    agree = printed = 0
    for m, manner in enumerate(result.manners):
        for o, name in enumerate(result.objects):
            row = [manner.name.lower(), name]
            for value, paper in zip_longest(result.success[m, o], _paper(model, manner, name)):
                same = paper is not None and abs(value - paper) < 5e-5
                agree, printed = agree + same, printed + (paper is not None)
                beside = '' if paper is None else f' ({paper:.4f}){" " if same else "*"}'
                row.append(f'{value:.4f}{beside or " "}')
            table.append(row)
    lines = [
        paragraph(f'Table 1: hypothetical success, from {model.label}{beside_it}.'),
        *aligned(table, left=2),
    ]
    if not printed:
        return '\n'.join(lines)
    lines.append(f'{agree} of {printed} cells as printed.')
    if model.label != model_file.shipped().label:
        if agree < printed:
            lines.append('* another robot.')
    else:
        manner, name, mode = MISPRINT
        lines.append(
            paragraph(
                f'* {name}, {manner.name.lower()}, {mode}: a misprint. The mode does not depend '
                'on the manner of the demonstration, and the place row of this model is 0.8250.'
            )
        )
    return '\n'.join(lines)


def report_fig7(options: ReproductionOptions) -> ReproductionReport:
    """Fig 7; another robot with the same objects is shown beside the paper's."""
    model, papers, world = model_of(options), model_file.shipped(), options.world
    series = {model.label: fig7(model, world)}
    if set(model.objects) == set(papers.objects) and model.domain == papers.domain:
        series.setdefault(papers.label, fig7(papers, world))
    document: dict[str, Any] = {
        'model': model.label,
        'states': [state.name for state in options.world.states],
        'rows': _fig7_rows(series[model.label]),
    }
    others = [label for label in series if label != model.label]
    if others:
        document['beside'] = {'model': others[0], 'rows': _fig7_rows(series[others[0]])}
    text, note = _fig7_text(series, world), FIG_7 if model.domain == TABLETOP else ''
    if note:
        document['paper'] = note
        text += f'\n{paragraph(note)}'
    return ReproductionReport(document, text, lambda: figures.fig7(series, world, note))


def _fig7_rows(bars: list[TransitionBars]) -> list[dict[str, Any]]:
    return [bar._asdict() | {'x_i': bar.x_i.name, 'action': bar.action.name} for bar in bars]


def _fig7_text(series: dict[str, list[TransitionBars]], world: World) -> str:
    (label, bars), *others = series.items()
    beside = {(b.object, b.x_i, b.action): b for _, known in others for b in known}
    brackets = ''.join(f'; in brackets {name}' for name, _ in others)
    table = [['action', 'n', *(state.name for state in world.states)]]
    shown = None
    for bar in bars:
        if (bar.object, bar.x_i) != shown:
            shown = bar.object, bar.x_i
            table.append([f'{bar.object}, x_i = {bar.x_i.name}'])
        other = beside.get((bar.object, bar.x_i, bar.action))
        cells = [
            f'{p:.2f} {short(low)}-{short(high)}'
            + (f' ({short(other.probability[k])})' if other else '')
            for k, (p, low, high) in enumerate(
                zip(bar.probability, bar.low, bar.high, strict=True)
            )
        ]
        table.append([f'  {bar.action.name}', str(bar.trials), *cells])
    return '\n'.join(
        [
            paragraph(
                f'Fig 7: p(X_f | X_i, A) of {label}{brackets}; from n trials of each action, with '
                '95 % credible bounds.'
            ),
            *aligned(table, left=1),
        ]
    )


def report_fig8(options: ReproductionOptions) -> ReproductionReport:
    """Fig 8."""
    model = model_of(options)
    cases = fig8(model, options.world, THRESHOLD)
    document = {
        'model': model.label,
        'threshold': THRESHOLD,
        'states': [state.name for state in options.world.states],
        'actions': [action.name for action in options.world.actions],
        'rows': [_case(case) for case in cases],
    }
    text, notes = _fig8_text(model, options.world, cases), []
    if model.domain == TABLETOP:
        here = statements_of(cases, options.world)
        document |= {'paper': PAPER_ON_FIG8._asdict(), 'here': here._asdict()}
        rows = list(zip(STATED, PAPER_ON_FIG8.words(), here.words(), strict=True))
        text += '\n' + '\n'.join(aligned([['stated', 'the paper', 'here'], *rows], left=3))
        notes = [f'{stated}: the paper {paper}; here {ours}' for stated, paper, ours in rows]
    return ReproductionReport(
        document, text, lambda: figures.fig8(cases, options.world, THRESHOLD, notes)
    )


def _case(case: Fig8Column) -> dict[str, Any]:
    return {
        'object': case.object,
        'x_i': case.x_i.name,
        'x_f': case.x_f.name,
        'goal_posterior': case.goal_posterior,
        'goal': case.goal.name,
        'action_posterior': case.action_posterior,
        'action': None if case.action is None else case.action.name,
        'predicted': case.predicted,
        'predicted_success': None if case.action is None else case.predicted_success,
        'asks': case.asks,
    }


def _fig8_text(model: RobotModel, world: World, cases: list[Fig8Column]) -> str:
    about = (
        f'Fig 8: goals, actions and predictions by {model.label}. P(G | x_i, x_f) for each '
        'goal; the mode of P(A | x_i, g) and its probability; what it is predicted to reach, '
        f'P(X_f = g). *: below {THRESHOLD:.2f}, asks.'
    )
    table = [
        ['object', 'shown', 'action', *(state.name for state in world.states), 'P(A)', 'P(X_f=g) ']
    ]
    for case in cases:
        name, p_action = '-', 0.0
        if case.action is not None:
            name, p_action = case.action.name, case.action_posterior[case.action]
        table.append(
            [
                case.object, f'{case.x_i.name}>{case.x_f.name}', name,
                *(short(p, 4) for p in case.goal_posterior), f'{p_action:.2f}',
                f'{case.predicted_success:.2f}{"*" if case.asks else " "}',
            ]
        )  # fmt: skip
    lines = [paragraph(about), *aligned(table, left=3)]
    right = sum(case.goal == case.x_f for case in cases)
    lines.append(f'The true goal is the MAP goal in {right} of {len(cases)}.')
    return '\n'.join(lines)


def report_sequential(options: ReproductionOptions) -> ReproductionReport:
    """Several actions, with a look after each."""
    model = model_of(options)
    rows = sequential(model, options.world, threshold=THRESHOLD)
    document = {
        'model': model.label,
        'threshold': THRESHOLD,
        'rows': [row._asdict() for row in rows],
    }
    return ReproductionReport(
        document, _sequential_text(model, rows), lambda: figures.sequential(rows)
    )


def _sequential_text(model: RobotModel, rows: list[SequentialRow]) -> str:
    table = [['actions', 'object', 'success', 'help rate', 'with help', 'asking early']]
    for budget in dict.fromkeys(row.actions for row in rows):
        mine = [row for row in rows if row.actions == budget]
        means = np.mean([row[2:] for row in mine], axis=0).tolist()
        values = [(row.object, row[2:]) for row in mine] + [('mean', means)]
        table += [[str(budget), name, *(f'{v:.4f}' for v in each)] for name, each in values]
    about = (
        f'Up to so many actions, with a look after each: exact values by {model.label}, averaged '
        'over the changes of state. With help: the robot asks after its last action, and the '
        'human always succeeds. Asking early: the help rate if it also asks where the best plan '
        f'is worth less than {THRESHOLD:.2f}. The paper acts once, and leaves several steps to '
        'future work.'
    )
    return '\n'.join([paragraph(about), *aligned(table, left=2)])


def report_practice(options: ReproductionOptions) -> ReproductionReport:
    """Convergence of goal-based exploration."""
    model = model_of(options)
    result = practice(model, options.world, seeds=options.seeds or 20)
    shown = [0, 10, 30, 100, 300, 1000]
    about = (
        'Goal-based exploration: distance of P(A | g, x_i) from its limit by rounds (total '
        f'variation, mean over {len(model.objects)} objects and the changes; in brackets that of '
        'the mean policy). The paper describes it (Methods) and sets the policy to the limit; it '
        'gives no number of rounds or of the step.'
    )
    told = [n for n in shown if n != 10]
    table = [['step', *map(str, told)]]
    for step, gap, mean_gap in zip(result.steps, result.distance, result.of_mean, strict=True):
        cells = (f'{short(gap[n], 3)} ({short(mean_gap[n], 3)})' for n in told)
        table.append([f'{step:.2f}', *cells])
    lines = [paragraph(about), *aligned(table, left=0)]
    document = {
        'model': model.label,
        'steps': result.steps,
        'rounds': shown,
        'distance': result.distance[:, shown].tolist(),
        'distance_of_mean': result.of_mean[:, shown].tolist(),
    }
    return ReproductionReport(document, '\n'.join(lines), lambda: figures.practice(result))


REPRODUCTIONS = {
    'table1': Reproduction(
        'Table 1: success of three approaches to imitation', report_table1, TAKES
    ),
    'fig7': Reproduction('Fig 7: the learned transitions', report_fig7, TAKES),
    'fig8': Reproduction('Fig 8: goals, actions, predictions', report_fig8, TAKES),
    'sequential': Reproduction('Several actions (beyond the paper)', report_sequential, TAKES),
    'practice': Reproduction(
        'Convergence of goal-based exploration (Methods)',
        report_practice,
        TAKES | {'seeds'},
    ),
}
