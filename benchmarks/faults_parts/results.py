"""Results of the offline campaign, and the processes that play its cells."""

from __future__ import annotations

import math
import multiprocessing
import os
import time
from collections import Counter
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from typing import Any, NamedTuple

from rich.console import Console

from likeme_core.progress_bar import ProgressBar

#: Stories of one cell.
STORIES = 50


class Trouble(NamedTuple):
    """What went wrong: cell (its seed) and story by their numbers, what, and the fault."""

    cell: int
    story: int
    what: str
    fault: str


class CellResult(NamedTuple):
    """Results of one cell, or of several.

    Attributes:
        faults: number by kind.
        finished: number of stories that were finished.
        violations, unfinished, lost_questions, lost_entries: what went wrong.
        recovery: s from each fault to the story's outcome, simulated; 0 if it came after it.
    """

    faults: Counter[str]
    finished: int
    violations: list[Trouble]
    unfinished: list[Trouble]
    lost_questions: list[Trouble]
    lost_entries: list[Trouble]
    recovery: list[float]

    def plus(self, other: CellResult) -> CellResult:
        """The results of both."""
        pairs: Any = zip(self, other, strict=True)
        return CellResult(*(mine + its for mine, its in pairs))


def run(count: int, seed: int) -> tuple[CellResult, float]:
    """Run so many faults in cells from a seed on, one process a core; results and wall time, s."""
    begin, total, cells = time.monotonic(), CellResult(Counter(), 0, [], [], [], [], []), seed
    processes = len(os.sched_getaffinity(0)) if count > STORIES else 1
    # Each reads simulated time: it must not be a copy of this process.
    context = multiprocessing.get_context('spawn')
    bar = ProgressBar(Console(stderr=True), 'faults in simulated time', count, 0, math.inf)
    with ProcessPoolExecutor(processes, mp_context=context) as pool, bar.shown():
        playing: dict[Future[CellResult], int] = {}
        while (done := sum(total.faults.values())) < count:
            promised = sum(playing.values())
            while len(playing) < processes and done + promised < count:
                stories = min(STORIES, count - done - promised)
                playing[pool.submit(play, cells, stories)] = stories
                cells, promised = cells + 1, promised + stories
            ended, _ = wait(playing, return_when=FIRST_COMPLETED)
            for future in ended:
                del playing[future]
                total = total.plus(future.result())
            bar.reach(sum(total.faults.values()))
    return total, time.monotonic() - begin


def play(number: int, stories: int) -> CellResult:
    """Play one cell in this process, which reads simulated time from then on."""
    from faults_parts import offline

    return offline.play_cell(number, stories)


def soak(stories: int, seed: int) -> tuple[int, list[float]]:
    """Play so many stories in one cell, see offline.soak."""
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        return pool.submit(_soak, seed, stories).result()


def _soak(number: int, stories: int) -> tuple[int, list[float]]:
    from faults_parts import offline

    return offline.soak(number, stories)
