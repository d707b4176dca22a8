"""Trials of simulated cells with other numbers: what the search learns from.

What is tried follows from the seed and what was found before alone, so that any number of
processes, in any order and after any restart, gives the same search.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

from likeme_arm_sim.headless_trial import (
    count_final_states,
    settings_from_parameters,
    single_object_cell,
)
from likeme_experiments import json_lines
from likeme_experiments.physics_fit.search import Counts
from likeme_experiments.physics_fit.trial_rows import Row


class Tried(NamedTuple):
    """Trials of one toy with one level of one number.

    Attributes:
        step: of the search.
        parameter, level: what was tried, in its own unit.
        name: of the toy.
        counts: LEFT, RIGHT, OFFTABLE by row name.
    """

    step: int
    parameter: str
    level: float
    name: str
    counts: dict[str, Counts]


def try_level(
    step: int, parameter: str, values: Mapping[str, float], mine: list[Row], seeds: range
) -> Tried:
    """The same seeds for every row of a toy and for every level."""
    name = mine[0].name
    cell = single_object_cell(name, settings_from_parameters(values))
    counts = {str(r): count_final_states(cell, name, r.x_i, r.action, seeds) for r in mine}
    return Tried(step, parameter, values[parameter], name, counts)


def try_levels(
    path: Path,
    step: int,
    parameter: str,
    wanted: list[float],
    values: Mapping[str, float],
    touched: list[Row],
    seeds: range,
    workers: int,
    on_progress: Callable[[int], None],
) -> dict[float, dict[str, Counts]]:
    """Counts by row, by level; what the file does not have yet is made and added to it."""
    names = sorted({row.name for row in touched})
    jobs_of = [(level, name) for level in wanted for name in names]
    done = {(t.level, t.name): t for t in read(path) if t.step == step}
    on_progress(len(done))
    # Physics clients do not survive a fork.
    with ProcessPoolExecutor(workers, get_context('spawn')) as pool:
        jobs: list[Future[Tried]] = [
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


def read(path: Path) -> list[Tried]:
    """All complete lines of a file; none without the file."""
    return [_tried(document) for document in json_lines.documents(path)]


def _tried(document: dict[str, Any]) -> Tried:
    counts = {row: (c[0], c[1], c[2]) for row, c in document.pop('counts').items()}
    return Tried(counts=counts, **document)
