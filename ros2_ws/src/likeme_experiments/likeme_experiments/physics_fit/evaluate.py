"""Evaluation of parameters against the real robot's table, with seeds the search never used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import closing
from multiprocessing import get_context
from typing import NamedTuple

import cv2

from likeme_arm_sim.headless_trial import (
    count_final_states,
    fitted_cell,
    settings_from_parameters,
    world_from_parameters,
)
from likeme_core.paper_world import WORLD
from likeme_experiments.learning.trial_cell import TrialCell
from likeme_experiments.physics_fit.multinomial_test import multinomial_p_value, smoothed
from likeme_experiments.physics_fit.table_rows import TableRow
from likeme_inference.experience.trial import Pair, TrialKey

# Search seeds are drawn below 2**31.
FRESH = 2**31
LEVEL = 0.05


class RowEvaluation(NamedTuple):
    """A row, its simulated counts by final state, and the p-value of the exact test."""

    row: TableRow
    simulated: tuple[int, ...]
    p_value: float

    @property
    def passes(self) -> bool:
        """Whether the test does not reject the simulated row at the 5 % level."""
        return self.p_value > LEVEL


def evaluate_row(
    values: Mapping[str, float], row: TableRow, trials: int, first: int = FRESH
) -> RowEvaluation:
    """Try one row with the seeds from `first` on."""
    cell = fitted_cell(WORLD, row.name, values)
    seeds = range(first, first + trials)
    counts = count_final_states(cell, row.name, row.x_i, row.action, seeds)
    return RowEvaluation(row, counts, multinomial_p_value(row.real, smoothed(counts)))


def evaluate_row_by_camera(
    values: Mapping[str, float], row: TableRow, trials: int, first: int = FRESH
) -> RowEvaluation:
    """As `evaluate_row` by full trials: the states that perception reports."""
    # One trial uses one core; OpenCV's threads would compete with the other trials.
    cv2.setNumThreads(1)
    pair, ends = Pair(row.name, row.x_i, row.action), [0, 0, 0]
    with closing(fitted_trial_cell(row.name, values)) as cell:
        for repetition in range(trials):
            ends[cell.run(TrialKey('judged', 'judged', pair, repetition), first).x_f] += 1
    counts = (ends[0], ends[1], ends[2])
    return RowEvaluation(row, counts, multinomial_p_value(row.real, smoothed(counts)))


def fitted_trial_cell(name: str, values: Mapping[str, float]) -> TrialCell:
    """A cell for full trials with values of all fitted parameters."""
    world = world_from_parameters(WORLD, values)
    return TrialCell(world, name, settings_from_parameters(WORLD, values))


def evaluate_rows(
    values: Mapping[str, float],
    table: list[TableRow],
    trials: int,
    workers: int,
    on_progress: Callable[[int], None],
    first: int = FRESH,
    by_camera: bool = False,
) -> list[RowEvaluation]:
    """Try every row with the seeds from `first` on; in the order of the table."""
    evaluate = evaluate_row_by_camera if by_camera else evaluate_row
    with ProcessPoolExecutor(workers, get_context('spawn')) as pool:
        jobs = [pool.submit(evaluate, values, row, trials, first) for row in table]
        for done, _ in enumerate(as_completed(jobs), 1):
            on_progress(done)
        return [job.result() for job in jobs]


def table_text(table: list[RowEvaluation], seen: list[TableRow]) -> str:
    """Both tables side by side, and how many rows pass the test."""
    lines = [f'{"row":<30}{"simulated":>14}{"real":>14}{"p":>8}  L R O']
    for entry in table:
        mark = '' if entry.passes else '  fails'
        held = '' if entry.row in seen else '  held out'
        counts = '/'.join(map(str, entry.simulated))
        real = '/'.join(map(str, entry.row.real))
        lines.append(f'{entry.row!s:<30}{counts:>14}{real:>14}{entry.p_value:8.3f}{held}{mark}')
    fitted = [entry for entry in table if entry.row in seen]
    busy = [e for e in table if e.row not in seen and not e.row.idle]
    idle = [e for e in table if e.row.idle]
    parts = (('all', table), ('fitted', fitted), ('held out', busy), ('held out, idle', idle))
    shares = [f'{name} {sum(e.passes for e in part)} of {len(part)}' for name, part in parts]
    return '\n'.join([*lines, f'Rows that pass at {LEVEL}: ' + '; '.join(shares) + '.'])
