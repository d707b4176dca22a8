"""Could the model have made the robot's trials? Posterior predictive and held-out checks."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from likeme_core.world import World
from likeme_experiments.evaluation.predictive_checks import (
    SPLITS,
    ModelCheck,
    predictive_checks,
)
from likeme_experiments.reproductions import scientists_figures as figures
from likeme_experiments.reproductions.models import batches_of, model_of
from likeme_experiments.reproductions.report import (
    Reproduction,
    ReproductionOptions,
    ReproductionReport,
)
from likeme_experiments.reproductions.text_table import aligned, paragraph
from likeme_inference.tabletop.dirichlet import CONCENTRATION
from likeme_inference.tabletop.posterior_sampling import posterior_draws
from likeme_inference.tabletop.predictive_check import REPLICATIONS
from likeme_inference.tabletop.robot_model import RobotModel

SEED = 0
#: Rows with a p below it are listed.
SMALL = 0.05
NOTE = (
    'A p is the probability that the model makes trials at least as unlike its prediction. Rows: '
    'pairs of object, x_i within reach and action. least row: the smallest p, in brackets after '
    "Holm's correction for the number of rows; only that one is held against .05. posterior uses "
    'the trials twice, so that its p tends to 1/2: a great p there says little. The totals of '
    'a row cannot contradict it, as every p(X_f) is possible: what changes in the course of the '
    'trials shows in batches alone.'
)
PAPER = 'The paper checks none of this, and gives totals, without the order of its trials.'


def report_predictive_check(options: ReproductionOptions) -> ReproductionReport:
    """p of each row and overall by every check that the trials allow."""
    model, world = model_of(options), options.world
    batches = batches_of(options, model)
    rng = np.random.default_rng(SEED)
    checks = predictive_checks(model, batches, rng, options.seeds or SPLITS)
    document = {
        'model': model.label,
        'concentration': CONCENTRATION,
        'seed': SEED,
        'replications': REPLICATIONS,
        'batches': 0 if batches is None else len(batches),
        'checks': [_document(check, model, world) for check in checks],
    }
    return ReproductionReport(
        document,
        _text(model, world, checks),
        lambda: figures.predictive_checks(
            checks, posterior_draws(model, np.random.default_rng(SEED)), world
        ),
    )


def _document(check: ModelCheck, model: RobotModel, world: World) -> dict[str, Any]:
    return {
        'name': check.name,
        'about': check.about,
        'uses_trials_twice': check.twice,
        'overall': check.overall,
        'rows': [
            {
                'object': name, 'x_i': world.states[x_i].name, 'action': world.actions[a].name,
                'p': float(check.p[o, x_i, a]), 'holm': float(check.corrected[o, x_i, a]),
            }
            for o, name in enumerate(_objects(check, model))
            for x_i, a in product(range(len(world.states)), range(len(world.actions)))
            if np.isfinite(check.p[o, x_i, a])
        ],
    }  # fmt: skip


def _objects(check: ModelCheck, model: RobotModel) -> list[str]:
    return ['all'] if len(check.p) < len(model.objects) else list(model.objects)


def _text(model: RobotModel, world: World, checks: list[ModelCheck]) -> str:
    table = [['check', 'rows', 'overall', 'least row']]
    small = [['check', 'row', 'trials', 'p', 'Holm']]
    for check in checks:
        tested = np.isfinite(check.p)
        least = f'{np.nanmin(check.p):.4f} ({np.nanmin(check.corrected):.2f})'
        n = str(int(tested.sum()))
        table.append([check.name, n, f'{check.overall:.4f}', least])
        for o, x_i, a in zip(*np.nonzero(check.p < SMALL), strict=True):
            name = _objects(check, model)[o]
            row = f'{name}, {world.states[x_i].name}, {world.actions[a].name}'
            known = list(model.objects.values())
            made = sum(k.counts[x_i, a] for k in (known if name == 'all' else [known[o]]))
            small.append(
                [
                    check.name, row, '/'.join(map(str, made)),
                    f'{check.p[o, x_i, a]:.4f}', f'{check.corrected[o, x_i, a]:.2f}',
                ]
            )  # fmt: skip
    lines = [
        paragraph(f'Predictive checks of {model.label}, concentration {CONCENTRATION:g}. {PAPER}'),
        *aligned(table, left=1),
        *(f'{check.name}: {check.about}' for check in checks),
        f'Rows with a p below {SMALL:g}, trials by final state:',
        *aligned(small, left=2),
        paragraph(NOTE),
    ]
    return '\n'.join(lines)


REPRODUCTIONS = {
    'predictive-check': Reproduction(
        'Could the model have made the trials? (beyond the paper)',
        report_predictive_check,
        frozenset({'world', 'model', 'workers', 'seeds'}),
    ),
}
