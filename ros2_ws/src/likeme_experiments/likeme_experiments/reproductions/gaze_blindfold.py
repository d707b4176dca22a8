"""Figure 6: gaze following of a blindfolded mentor, by the agents' own experience."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from likeme_core.progress_bar import counted
from likeme_experiments.evaluation.blindfold_detection import (
    DETECTION_POINTS,
    blindfold_probabilities,
    detection_correct,
)
from likeme_experiments.evaluation.blindfold_groups import (
    GROUPS,
    differs_from_zero,
    follows_more,
    group_score,
    group_turns,
)
from likeme_experiments.reproductions.paper_statements import FIG_6
from likeme_experiments.reproductions.report import (
    Reproduction,
    ReproductionOptions,
    ReproductionReport,
)
from likeme_experiments.reproductions.text_table import paragraph
from likeme_gaze.blindfold import EXECUTIONS, POINTS, THRESHOLDS, TRIALS, InfantGroup
from likeme_gaze.simulation import DEGREE

#: Twenty agents in each of the paper's three groups.
AGENTS = 20
#: Mean looking scores of the authors' code at 30 degrees, as shipped and corrected.
AUTHORS_CODE = {'baseline': (2.08, 3.40), 'windowed': (2.14, 3.67), 'opaque': (0.00, 0.05)}


def figure_6(options: ReproductionOptions) -> ReproductionReport:
    """Looking scores of the paper's three groups and of the older infants it mentions."""
    seeds = range(1, (options.seeds or 1) + 1)
    turned = {group.name: all_turns(group, seeds, options.workers or 1) for group in GROUPS}
    following = np.concatenate([turned['baseline'], turned['windowed']])
    document = {
        'figure': 6,
        'seeds': list(seeds),
        'agents_per_group': len(turned['baseline']),
        'trials': TRIALS,
        'training_points': POINTS,
        'groups': [_entry(group, turned[group.name]) for group in GROUPS],
        'p_baseline_and_windowed_above_opaque': follows_more(following, turned['opaque']),
        'p_opaque_differs_from_0': differs_from_zero(turned['opaque']),
        'paper': FIG_6,
        'authors_code_at_30_deg': AUTHORS_CODE,
        'told_by_movements': detected_by_movements(seeds, options.workers or 1),
    }

    def figure() -> Any:
        from likeme_experiments.reproductions.gaze_blindfold_figure import draw_scores

        return draw_scores(document)

    return ReproductionReport(document, _table(document), figure)


def all_turns(group: InfantGroup, seeds: range, workers: int) -> NDArray[np.float64]:
    """Turns of AGENTS agents for every seed, rad (agents, trials)."""
    with ProcessPoolExecutor(workers) as pool:
        found = pool.map(group_turns, seeds, repeat(group), repeat(AGENTS))
        return np.concatenate(list(counted(found, f'seeds of {group.name}', len(seeds))))


def detected_by_movements(seeds: range, workers: int) -> dict[str, Any]:
    """How often AGENTS agents for every seed detect whether a mentor is blindfolded."""
    each = [(seed, agent) for seed in seeds for agent in range(AGENTS)]
    with ProcessPoolExecutor(workers) as pool:
        found = pool.map(blindfold_probabilities, *zip(*each, strict=True))
        right = detection_correct(np.array(list(counted(found, 'agents', len(each)))))
    share = right.mean(axis=(0, 3))
    return {
        'training_points': DETECTION_POINTS,
        'mentors_of_each_kind': right[:, 0, 0].size,
        'right_after_each_movement': share.mean(axis=1).tolist(),
        'right_of_seeing': share[:, 0].tolist(),
        'right_of_blindfolded': share[:, 1].tolist(),
    }


def _entry(group: InfantGroup, turned: NDArray[np.float64]) -> dict[str, Any]:
    return {
        'name': group.name,
        'experience': group.experience.value,
        'eyes_covered': group.covers,
        'infants_follow': group.follows,
        'mean_turn_deg': float(turned.mean() / DEGREE),
        'scores': {
            f'{threshold / DEGREE:.0f}': group_score(turned, threshold)._asdict()
            for threshold in THRESHOLDS
        },
    }


def _table(document: dict[str, Any]) -> str:
    about = (
        f'Looking score (-{TRIALS} to {TRIALS}), mean and standard error, '
        f'{document["agents_per_group"]} agents a group; authors: the mean by their code at 30 '
        'deg, as it is and corrected.'
    )
    lines = [
        paragraph(about),
        f'{"group":24}{"30 deg":>14}{"35 deg":>14}   infants   authors',
    ]
    for entry in document['groups']:
        cells = [f'{s["mean"]:.2f} +- {s["standard_error"]:.2f}' for s in entry['scores'].values()]
        beside = AUTHORS_CODE.get(entry['name'])
        theirs = '' if beside is None else f'{beside[0]:.2f}, {beside[1]:.2f}'
        does = 'follow' if entry['infants_follow'] else 'do not'
        lines.append(
            f'{entry["name"]:24}{cells[0]:>14}{cells[1]:>14}   {does:10}{theirs}'.rstrip()
        )
    tests = (
        f'baseline and windowed above opaque: p = '
        f'{document["p_baseline_and_windowed_above_opaque"]:.1e}; '
        f'opaque differs from 0: p = {document["p_opaque_differs_from_0"]:.2f}'
    )
    detected = document['told_by_movements']
    shares = ', '.join(f'{100 * share:.0f}' for share in detected['right_after_each_movement'])
    told = (
        f'by movements alone, who is blindfolded: {shares} % right after 1 to {EXECUTIONS} '
        f'movements ({2 * detected["mentors_of_each_kind"]} mentors; agents of '
        f'{detected["training_points"]} movements)'
    )
    return '\n'.join([*lines, *map(paragraph, (tests, told, FIG_6))])


FIGURES = {
    'fig6': Reproduction(
        'who follows a blindfolded gaze, by self-experience',
        figure_6,
        frozenset({'seeds', 'workers'}),
    )
}
