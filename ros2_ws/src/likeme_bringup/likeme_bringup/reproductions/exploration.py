"""Directed exploration: how many trials the robot's decisions need (paper: future work)."""

from __future__ import annotations

from typing import Any

from likeme_bringup.reproductions.exploration_figure import curves_figure
from likeme_bringup.reproductions.report import Options, Report, Reproduction
from likeme_bringup.reproductions.tabletop import model_of
from likeme_inference.experiments.exploration import (
    CHECKPOINTS,
    Curve,
    Way,
    exploration,
    world_of,
)
from likeme_inference.tabletop.exploration import help_rate

SEEDS = 200


def report_exploration(options: Options) -> Report:
    """Help rate against trials for each way to explore, in the world of a model."""
    model, seeds = model_of(options), options.seeds or SEEDS
    world = world_of(model)
    known = float(help_rate(world, world))
    curves = [curve for way in Way for curve in exploration(world, way, seeds)]
    document = {
        'world': model.label,
        'seeds': seeds,
        'world_known': known,
        'trials': list(CHECKPOINTS),
        'curves': [_row(curve) for curve in curves],
    }
    title = f'World: {model.label}; {seeds} seeds'
    return Report(
        document,
        _text(title, known, curves),
        lambda: curves_figure(title, CHECKPOINTS, curves, known),
    )


def _row(curve: Curve) -> dict[str, Any]:
    return {
        'policy': curve.way.value,
        'estimate': curve.estimate,
        'help_rate': curve.mean.tolist(),
        'standard_error': curve.error.tolist(),
    }


def _text(title: str, known: float, curves: list[Curve]) -> str:
    lines = [
        'Help rate, %, after learning and acting up to 3 times (standard error in brackets).',
        f'{title}. Knowing the world: {100 * known:.2f} %.',
        f'{"policy":18}{"estimate":20}' + ''.join(f'{n:>13}' for n in CHECKPOINTS),
    ]
    for curve in curves:
        cells = (
            f'{100 * m:6.2f} ({100 * e:.2f})' for m, e in zip(curve.mean, curve.error, strict=True)
        )
        lines.append(
            f'{curve.way.value:18}{curve.estimate:20}' + ''.join(map('{:>13}'.format, cells))
        )
    return '\n'.join(lines)


REPRODUCTIONS = {
    'exploration': Reproduction(
        'Directed exploration: help rate against trials',
        report_exploration,
        frozenset({'seeds', 'model'}),
    ),
}
