"""Figures 4 and 5: goals inferred by gaze following, and errors of the three inferences."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from likeme_core.progress_bar import counted
from likeme_experiments.evaluation.gaze_accuracy import GazeErrors, gaze_accuracy
from likeme_experiments.evaluation.gaze_scene import GazeScene, gaze_scene
from likeme_experiments.reproductions.paper_statements import FIG_4, FIG_5
from likeme_experiments.reproductions.report import (
    Reproduction,
    ReproductionOptions,
    ReproductionReport,
)
from likeme_experiments.reproductions.text_table import paragraph
from likeme_gaze.simulation import DEGREE

SEEDS = 6
#: Median and 90th percentile after five observations, degrees: the authors' code, as shipped and
#: with its gradient corrected and a noise floor; six seeds, Octave. The paper draws histograms.
AUTHORS_CODE = {
    'forward': ((1.77, 4.88), (1.49, 3.86)),
    'reverse': ((2.49, 6.91), (2.32, 6.08)),
    'following': ((2.86, 7.51), (2.14, 6.00)),
}


def figure_4(options: ReproductionOptions) -> ReproductionReport:
    """Agent, mentor and inferred goals, as in Fig 4."""
    scenes = [gaze_scene(seed) for seed in range(1, (options.seeds or 1) + 1)]
    document = {
        'figure': 4,
        'seeds': list(range(1, len(scenes) + 1)),
        'unit': 'cm, degrees',
        'paper': FIG_4,
        'scenes': [_scene(scene) for scene in scenes],
    }
    lines = ['Goals equally far from agent and mentor, inferred from five observations (cm).']
    lines += ['true goal      inferred           off', *_scene_rows(scenes[0])]
    pooled = np.concatenate([scene.distance_off for scene in scenes])
    lines.append(f'median distance off {np.median(pooled):.1f} cm, greatest {pooled.max():.1f} cm')
    lines.append(paragraph(FIG_4))

    def figure() -> Any:
        from likeme_experiments.reproductions.gaze_figure import draw_scene

        return draw_scene(scenes[0])

    return ReproductionReport(document, '\n'.join(lines), figure)


def figure_5(options: ReproductionOptions) -> ReproductionReport:
    """Errors of forward inference, reverse inference and gaze following, as in Fig 5."""
    seeds = range(1, (options.seeds or SEEDS) + 1)
    with ProcessPoolExecutor(options.workers or 1) as pool:
        errors = list(counted(pool.map(gaze_accuracy, seeds), 'seeds', len(seeds)))
    pooled = summary(errors)
    document = {
        'figure': 5,
        'seeds': list(seeds),
        'unit': 'degrees',
        'test_points': len(errors[0].forward),
        'training_points': 200,
        'per_seed': [
            {'seed': seed} | summary([each]) for seed, each in zip(seeds, errors, strict=True)
        ],
        'pooled': pooled,
        'paper': FIG_5,
        'authors_code_after_5': AUTHORS_CODE,
    }

    def figure() -> Any:
        from likeme_experiments.reproductions.gaze_figure import draw_histograms

        return draw_histograms(errors)

    return ReproductionReport(document, _accuracy_table(pooled, len(errors)), figure)


def summary(errors: Sequence[GazeErrors]) -> dict[str, Any]:
    """Median, p90 and RMS of |error| in degrees and the coverage, after each observation."""
    steps = range(len(errors[0].reverse))

    def after_each(name: str) -> list[dict[str, float]]:
        return [
            {'observations': k + 1}
            | spread(np.concatenate([getattr(each, name)[k] for each in errors]))
            for k in steps
        ]

    return {
        'forward': spread(np.concatenate([each.forward for each in errors])),
        'reverse': after_each('reverse'),
        'following': after_each('following'),
        'coverage_95': [float(np.mean([each.covered[k] for each in errors])) for k in steps],
    }


def spread(error: NDArray[np.float64]) -> dict[str, float]:
    """Median, 90th percentile and RMS of |error|."""
    size = np.abs(error)
    return {
        'median': float(np.median(size)),
        'p90': float(np.quantile(size, 0.9)),
        'rms': float(np.sqrt((size**2).mean())),
    }


def _accuracy_table(pooled: dict[str, Any], seeds: int) -> str:
    lines = [
        f'|error| in degrees, {seeds} seeds x 375 goals, 200 training points.',
        f'{"":12}{"observations":14}{"median":>8}{"p90":>8}{"RMS":>8}   authors code, corrected',
    ]
    rows = [('forward', '-', pooled['forward'])]
    for name in ('reverse', 'following'):
        rows += [(name, str(step['observations']), step) for step in pooled[name]]
    for name, observations, step in rows:
        beside = ''
        if observations in ('-', str(len(pooled['reverse']))):
            (a, b), (c, d) = AUTHORS_CODE[name]
            beside = f'   {a:.2f} / {b:.2f}, {c:.2f} / {d:.2f}'
        figures = ''.join(f'{step[key]:8.2f}' for key in ('median', 'p90', 'rms'))
        lines.append(f'{name:12}{observations:14}{figures}{beside}')
    shares = ', '.join(f'{share:.1%}' for share in pooled['coverage_95'])
    lines.append(paragraph(f'95 % region of the goal holds the true one, after 1 to 5: {shares}'))
    lines.append(paragraph(FIG_5))
    return '\n'.join(lines)


def _scene(scene: GazeScene) -> dict[str, Any]:
    return {
        'goal': scene.test.goal.tolist(),
        'inferred_goal': scene.inferred.mean.tolist(),
        'inferred_covariance': scene.inferred.covariance.tolist(),
        'distance_off': scene.distance_off.tolist(),
        'agent_start_deg': (scene.test.agent_start / DEGREE).tolist(),
        'agent_final_deg': (scene.agent_final / DEGREE).tolist(),
        'mentor_start_deg': (scene.test.mentor_start / DEGREE).tolist(),
        'mentor_final_deg': (scene.test.final[..., 0] / DEGREE).tolist(),
    }


def _scene_rows(scene: GazeScene) -> list[str]:
    return [
        f'({g[0]:.0f}, {g[1]:4.0f})    ({m[0]:6.1f}, {m[1]:6.1f})  {off:5.1f}'
        for g, m, off in zip(scene.test.goal, scene.inferred.mean, scene.distance_off, strict=True)
    ]


FIGURES = {
    'fig4': Reproduction(
        'gaze following: inferred goals beside the true ones', figure_4, frozenset({'seeds'})
    ),
    'fig5': Reproduction(
        'gaze following: errors of forward, reverse, following',
        figure_5,
        frozenset({'seeds', 'workers'}),
    ),
}
