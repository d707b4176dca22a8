"""How well parameters reproduce the real robot's table, with seeds the search never used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from multiprocessing import get_context
from typing import NamedTuple

import cv2

from likeme_arm_sim.headless_trial import (
    count_final_states,
    settings_from_parameters,
    single_object_cell,
)
from likeme_core.tabletop import Action, State
from likeme_experiments.learning.trial_cell import TrialCell
from likeme_experiments.physics_fit.multinomial_test import multinomial_p_value, smoothed
from likeme_experiments.physics_fit.trial_rows import Row
from likeme_inference.experience.trial import Pair, TrialKey

# Search seeds are drawn below 2**31.
FRESH = 2**31
LEVEL = 0.05


class Judged(NamedTuple):
    """A row, how its simulated trials ended (LEFT, RIGHT, OFFTABLE), and the exact test's p."""

    row: Row
    simulated: tuple[int, int, int]
    p_value: float

    @property
    def passes(self) -> bool:
        """Whether the real counts are what the simulated row would give, at the 5 % level."""
        return self.p_value > LEVEL


def judge_row(values: Mapping[str, float], row: Row, trials: int, first: int = FRESH) -> Judged:
    """Try one row with the seeds from `first` on."""
    cell = single_object_cell(row.name, settings_from_parameters(values))
    seeds = range(first, first + trials)
    counts = count_final_states(cell, row.name, row.x_i, row.action, seeds)
    return Judged(row, counts, multinomial_p_value(row.real, smoothed(counts)))


def judge_row_by_camera(
    values: Mapping[str, float], row: Row, trials: int, first: int = FRESH
) -> Judged:
    """As `judge_row` by full trials: what the camera saw, read by the whole perception."""
    # A trial is one thread's work; OpenCV's would wait for other trials' cores.
    cv2.setNumThreads(1)
    cell, ends = _trial_cell(row.name, tuple(values.items())), [0, 0, 0]
    for repetition in range(trials):
        pair = Pair(row.name, State(int(row.x_i)), Action(int(row.action)))
        ends[cell.run(TrialKey('judged', 'judged', pair, repetition), first).x_f] += 1
    counts = (ends[0], ends[1], ends[2])
    return Judged(row, counts, multinomial_p_value(row.real, smoothed(counts)))


@cache
def _trial_cell(name: str, values: tuple[tuple[str, float], ...]) -> TrialCell:
    return TrialCell(name, settings_from_parameters(dict(values)))


def judged(
    values: Mapping[str, float],
    table: list[Row],
    trials: int,
    workers: int,
    on_progress: Callable[[int], None],
    first: int = FRESH,
    by_camera: bool = False,
) -> list[Judged]:
    """Try every row with the seeds from `first` on; in the order of the table."""
    judge = judge_row_by_camera if by_camera else judge_row
    with ProcessPoolExecutor(workers, get_context('spawn')) as pool:
        jobs = [pool.submit(judge, values, row, trials, first) for row in table]
        for done, _ in enumerate(as_completed(jobs), 1):
            on_progress(done)
        return [job.result() for job in jobs]


def table_text(table: list[Judged], seen: list[Row]) -> str:
    """Both tables side by side, and how many rows pass."""
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
    told = [f'{name} {sum(e.passes for e in part)} of {len(part)}' for name, part in parts]
    return '\n'.join([*lines, f'Rows that pass at {LEVEL}: ' + '; '.join(told) + '.'])
