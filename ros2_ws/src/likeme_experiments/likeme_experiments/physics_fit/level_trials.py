"""Trials of simulated cells with different parameters, kept in a file.

Which trials are made follows from the seed and the results so far, so that the search is the same
for any number of processes and after any restart.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

from likeme_arm_sim.headless_trial import (
    count_final_states,
    fitted_cell,
)
from likeme_core.paper_world import WORLD
from likeme_experiments import json_lines
from likeme_experiments.physics_fit.search import Counts
from likeme_experiments.physics_fit.table_rows import TableRow


class LevelTrials(NamedTuple):
    """Trials of one toy with one level of one parameter.

    Attributes:
        step: of the search.
        parameter, level: its name and value, in its own unit.
        name: of the toy.
        counts: of final states, by row name.
    """

    step: int
    parameter: str
    level: float
    name: str
    counts: dict[str, Counts]


def try_level(
    step: int, parameter: str, values: Mapping[str, float], mine: list[TableRow], seeds: range
) -> LevelTrials:
    """Trials of the rows of one toy, with the same seeds for every row and level."""
    name = mine[0].name
    cell = fitted_cell(WORLD, name, values)
    counts = {str(r): count_final_states(cell, name, r.x_i, r.action, seeds) for r in mine}
    return LevelTrials(step, parameter, values[parameter], name, counts)


def try_levels(
    path: Path,
    step: int,
    parameter: str,
    wanted: list[float],
    values: Mapping[str, float],
    touched: list[TableRow],
    seeds: range,
    workers: int,
    on_progress: Callable[[int], None],
) -> dict[float, dict[str, Counts]]:
    """Counts by row, by level; trials that are not in the file are made and appended."""
    names = sorted({row.name for row in touched})
    jobs_of = [(level, name) for level in wanted for name in names]
    done = {(t.level, t.name): t for t in read(path) if t.step == step}
    on_progress(len(done))
    # Physics clients do not survive a fork.
    with ProcessPoolExecutor(workers, get_context('spawn')) as pool:
        jobs: list[Future[LevelTrials]] = [
            pool.submit(
                try_level, step, parameter, {**values, parameter: level},
                [row for row in touched if row.name == name], seeds,
            )
            for level, name in jobs_of if (level, name) not in done
        ]  # fmt: skip
        for job in as_completed(jobs):
            tried = job.result()
            json_lines.append(path, tried._asdict())
            done[tried.level, tried.name] = tried
            on_progress(len(done))
    by_level: dict[float, dict[str, Counts]] = {level: {} for level in wanted}
    for level, name in jobs_of:
        by_level[level] |= done[level, name].counts
    return by_level


def read(path: Path) -> list[LevelTrials]:
    """The trials in a file; none if it does not exist."""
    return [_tried(document) for document in json_lines.documents(path)]


def _tried(document: dict[str, Any]) -> LevelTrials:
    counts = {row: tuple(c) for row, c in document.pop('counts').items()}
    return LevelTrials(counts=counts, **document)
