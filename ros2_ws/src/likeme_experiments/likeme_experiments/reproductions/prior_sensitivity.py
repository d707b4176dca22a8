"""How goals, actions, predictions and asking depend on the prior of p(X_f | X_i, A)."""

from __future__ import annotations

from typing import Any

import numpy as np

from likeme_core.world import World
from likeme_experiments.reproductions import scientists_figures as figures
from likeme_experiments.reproductions.models import model_of
from likeme_experiments.reproductions.report import (
    Reproduction,
    ReproductionOptions,
    ReproductionReport,
)
from likeme_experiments.reproductions.text_table import aligned, paragraph, short
from likeme_inference.tabletop.prior import Prior
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.sensitivity import (
    GRID,
    NO_ACTION,
    PriorSensitivity,
    PriorSetting,
    TurningPoint,
    prior_sensitivity,
    turning_points,
)

THRESHOLD = 0.5
#: Of the grid, the settings in the text; the document and the figure have all.
SHOWN = ('ML', '0.09', '1', '3', '10', 'shared', 'structured')


def report_prior_sensitivity(options: ReproductionOptions) -> ReproductionReport:
    """What changes over a grid of priors; the paper's maximum likelihood is the reference."""
    model, world = model_of(options), options.world
    # A fitted prior says what objects have in common.
    settings = [s for s in GRID if len(model.objects) > 1 or s.prior is Prior.OWN]
    found = prior_sensitivity(model, settings, THRESHOLD)
    turning = turning_points(model, THRESHOLD)
    document = {
        'model': model.label,
        'threshold': THRESHOLD,
        'reference': found.settings[0].label,
        'settings': [_setting(setting) for setting in found.settings],
        'rows': [_row(found, turning, c, world) for c in range(len(found.changes))],
    }
    return ReproductionReport(
        document,
        _text(model, world, found, turning),
        lambda: figures.prior_sensitivity(found, turning, world, THRESHOLD),
    )


def _setting(setting: PriorSetting) -> dict[str, Any]:
    own = setting.prior is Prior.OWN
    concentration = setting.concentration if own else None
    return {'label': setting.label, 'prior': str(setting.prior), 'concentration': concentration}


def _row(
    found: PriorSensitivity, turning: tuple[TurningPoint, ...], c: int, world: World
) -> dict[str, Any]:
    name, x_i, x_f = found.changes[c]
    turns = turning[c]
    return {
        'object': name,
        'x_i': world.states[x_i].name,
        'x_f': world.states[x_f].name,
        'goal_posterior': found.posterior[:, c].tolist(),
        'goal': [world.states[g].name for g in found.goal[:, c]],
        'action': [None if a == NO_ACTION else world.actions[a].name for a in found.action[:, c]],
        'predicted_success': [None if np.isnan(p) else float(p) for p in found.success[:, c]],
        'asks': found.asks[:, c].tolist(),
        'differs': found.differs[:, c].tolist(),
        'turning_point': {'concentration': turns.concentration, 'what': turns.what}
        if turns.what
        else None,
    }


def _text(
    model: RobotModel, world: World, found: PriorSensitivity, turning: tuple[TurningPoint, ...]
) -> str:
    labels = [setting.label for setting in found.settings]
    shown = [labels.index(label) for label in SHOWN if label in labels]
    about = (
        f'Sensitivity to the prior of {model.label}: P(G = x_f | x_i, x_f), below it the '
        f'predicted success of the best action, *: below {THRESHOLD:.2f}, asks. ML: maximum '
        'likelihood, as in the paper; numbers: Dirichlet pseudo-counts of each final state; '
        'shared, structured: priors fitted to all objects. !: another goal, another action or '
        'another answer to whether to ask than with ML.'
    )
    # Above the numbers, whose marks take two more columns.
    heads = [labels[s] + '  ' * (len(labels[s]) < 5) for s in shown]
    table = [['object', 'shown', *heads]]
    for c, (name, x_i, x_f) in enumerate(found.changes):
        change = f'{world.states[x_i].name}>{world.states[x_f].name}'
        table.append([name, change, *(f'{short(found.posterior[s, c, x_f])}  ' for s in shown)])
        cells = (
            f'{short(found.success[s, c]) if found.action[s, c] != NO_ACTION else "-"}'
            f'{"*" if found.asks[s, c] else " "}{"!" if found.differs[s, c] else " "}'
            for s in shown
        )
        table.append(['', '', *cells])
    return '\n'.join(
        [paragraph(about), *aligned(table, left=2), *_differences(found, world), _turned(turning)]
    )


def _differences(found: PriorSensitivity, world: World) -> list[str]:
    """How many demonstrations each setting changes, and every action that is another one."""
    counts = {
        setting.label: int(found.differs[s].sum())
        for s, setting in enumerate(found.settings[1:], 1)
    }
    some = ', '.join(f'{n} with {label}' for label, n in counts.items() if n)
    none = ', '.join(label for label, n in counts.items() if not n)
    lines = [
        paragraph(
            f'Of {len(found.changes)} demonstrations change {some or "none"}'
            + (f'; none with {none}.' if some and none else '.')
        )
    ]
    right = (found.goal == [change.x_f for change in found.changes]).all(axis=1)
    wrong = [
        setting.label for setting, all_ in zip(found.settings, right, strict=True) if not all_
    ]
    lines.append(
        f'The goal is not always the state that was shown with: {", ".join(wrong)}.'
        if wrong
        else 'The MAP goal is the state that was shown with every prior.'
    )
    for c, (name, x_i, x_f) in enumerate(found.changes):
        other: dict[int, list[str]] = {}
        for s, setting in enumerate(found.settings):
            if found.action[s, c] not in (found.action[0, c], NO_ACTION):
                other.setdefault(int(found.action[s, c]), []).append(setting.label)
        first = int(found.action[0, c])
        was = 'nothing' if first == NO_ACTION else world.actions[first].name
        lines += [
            paragraph(
                f'{name}, {world.states[x_i].name} to {world.states[x_f].name}: '
                f'{world.actions[a].name} instead of {was} with {", ".join(labels)}.'
            )
            for a, labels in other.items()
        ]
    return lines


def _turned(turning: tuple[TurningPoint, ...]) -> str:
    found = [turn.concentration for turn in turning if turn.what]
    if not found:
        return paragraph('No concentration up to 100 changes what the robot does.')
    return paragraph(
        f'The least concentration that changes what the robot does: {min(found):.3g} in the first '
        f'demonstration, {max(found):.3g} in the last; none up to 100 in '
        f'{len(turning) - len(found)} of {len(turning)}.'
    )


REPRODUCTIONS = {
    'prior-sensitivity': Reproduction(
        'What depends on the prior of the transitions (beyond the paper)',
        report_prior_sensitivity,
        frozenset({'world', 'model', 'workers'}),
    ),
}
