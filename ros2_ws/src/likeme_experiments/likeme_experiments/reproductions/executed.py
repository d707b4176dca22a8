"""Table 1 carried out: in the simulated cell, through the camera, with a self-learned model."""

from __future__ import annotations

import os
from pathlib import Path

from rich.console import Console

from likeme_arm_sim.scene import OBJECTS
from likeme_experiments.learning.store_commands import default_place
from likeme_experiments.reproductions.executed_document import document_of
from likeme_experiments.reproductions.executed_figure import executed_figure
from likeme_experiments.reproductions.executed_findings import findings
from likeme_experiments.reproductions.executed_text import executed_text
from likeme_experiments.reproductions.models import LEARNED, model_of
from likeme_experiments.reproductions.report import Options, Report, Reproduction
from likeme_inference.tabletop import model_file
from likeme_inference.tabletop.domain import TABLETOP
from likeme_inference.tabletop.robot_model import RobotModel

SEEDS = 20
#: The estimate the table is about; the document holds the averages of all.
ESTIMATE = 'Dirichlet'


def report_executed(options: Options) -> Report:
    """Carry out what is missing and count."""
    # Takes two seconds to import, and who asks for the list needs none of it.
    from likeme_experiments.imitation.episode_log import Journal
    from likeme_experiments.imitation.episodes import ESTIMATES, EpisodeFailedError, tasks
    from likeme_experiments.imitation.runner import episodes

    seeds, workers = options.seeds or SEEDS, options.workers or len(os.sched_getaffinity(0))
    model = model_of(Options(model=options.model or LEARNED, workers=workers))
    text, wanted = model_file.format_model(model), tasks(_objects(model), seeds)
    journal = Journal(Path(default_place()).with_name('table1-executed'), text)
    try:
        made = episodes(wanted, text, journal, workers, Console(stderr=True))
    except EpisodeFailedError as error:
        raise ValueError(str(error)) from error
    found = {name: findings(model, made, name, by) for name, by in ESTIMATES.items()}
    document = document_of(model, seeds, made, found, ESTIMATE)
    return Report(
        document,
        executed_text(document),
        lambda: executed_figure(document),
    )


def _objects(model: RobotModel) -> tuple[str, ...]:
    """What the cell has and the model knows.

    Raises:
        ValueError: nothing, or the model is about another table.
    """
    if model.domain != TABLETOP:
        raise ValueError(f'Expected a model of {TABLETOP.states}, got {model.domain.states}.')
    known = tuple(name for name in OBJECTS if name in model.objects)
    if not known:
        raise ValueError(
            f'Expected a model of {", ".join(OBJECTS)}, got one of {list(model.objects)}.'
        )
    return known


REPRODUCTIONS = {
    'table1-executed': Reproduction(
        'Table 1 carried out in the simulated cell with a self-learned model (20 minutes)',
        report_executed,
        frozenset({'seeds', 'model', 'workers'}),
        in_all=False,
    ),
}
