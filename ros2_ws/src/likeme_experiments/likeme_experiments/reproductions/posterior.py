"""The posterior after the robot's trials: how sure decisions are, and its draws as files."""

from __future__ import annotations

from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from likeme_core.world import World
from likeme_experiments.evaluation.decision_draws import DecisionDraws, decision_draws
from likeme_experiments.reproductions import scientists_figures as figures
from likeme_experiments.reproductions.models import model_of
from likeme_experiments.reproductions.report import (
    Reproduction,
    ReproductionOptions,
    ReproductionReport,
)
from likeme_experiments.reproductions.text_table import aligned, paragraph, short
from likeme_inference.tabletop.dirichlet import CONCENTRATION
from likeme_inference.tabletop.posterior_sampling import PosteriorDraws, posterior_draws

THRESHOLD = 0.5
SEED = 0


def report_posterior(options: ReproductionOptions) -> ReproductionReport:
    """Goals and decisions over draws of p(X_f | X_i, A), and the draws."""
    if options.arviz and find_spec('arviz') is None:
        raise ValueError('expected the Python package arviz, which reproduce.sh installs.')
    model, world = model_of(options), options.world
    draws = posterior_draws(model, np.random.default_rng(SEED))
    rows = decision_draws(model, draws, THRESHOLD)
    document = {
        'model': model.label,
        'concentration': CONCENTRATION,
        'threshold': THRESHOLD,
        'seed': SEED,
        'chains': len(draws.posterior.counts),
        'draws': draws.posterior.counts.shape[1],
        'rows': [_row(row, world) for row in rows],
    }
    return ReproductionReport(
        document,
        _text(model.label, rows, world),
        lambda: figures.decision_draws(rows, world),
        partial(_save, draws, with_arviz=options.arviz),
    )


def _row(row: DecisionDraws, world: World) -> dict[str, object]:
    change = row.change
    return {
        'object': change.object,
        'x_i': world.states[change.x_i].name,
        'x_f': world.states[change.x_f].name,
        **{name: value for name, value in row._asdict().items() if name != 'change'},
    }


def _text(label: str, rows: list[DecisionDraws], world: World) -> str:
    about = (
        f'Posterior: P(G = x_f | x_i, x_f) by {label}: by maximum likelihood (ML), as in the '
        f'paper, and over draws from the Dirichlet posterior (concentration {CONCENTRATION:g}): '
        'mean and 95 % bounds; and the share of draws at which goal, action and asking are as '
        'with ML. The paper gives no uncertainty of its probabilities.'
    )
    table = [['object', 'shown', 'ML', 'mean', '95 %', 'goal', 'action', 'asking']]
    for row in rows:
        x_i, x_f = (world.states[x].name for x in (row.change.x_i, row.change.x_f))
        table.append(
            [
                row.change.object, f'{x_i}>{x_f}', short(row.reference), short(row.mean),
                f'{short(row.low)}-{short(row.high)}',
                *(short(v) for v in (row.same_goal, row.same_action, row.same_asking)),
            ]
        )  # fmt: skip
    return '\n'.join([paragraph(about), *aligned(table, left=2)])


def _save(draws: PosteriorDraws, folder: Path, name: str, with_arviz: bool) -> list[Path]:
    # Here, as only files need it.
    from likeme_inference.tabletop.posterior_file import save_draws

    paths = [folder / f'{name}.npz']
    save_draws(draws, paths[0])
    if with_arviz:
        from likeme_inference.tabletop.arviz_export import to_arviz

        paths.append(folder / f'{name}.nc')
        to_arviz(draws).to_netcdf(paths[1])
    return paths


REPRODUCTIONS = {
    'posterior': Reproduction(
        'How sure goals and decisions are; draws as .npz (beyond the paper)',
        report_posterior,
        frozenset({'world', 'model', 'workers', 'arviz'}),
    ),
}
