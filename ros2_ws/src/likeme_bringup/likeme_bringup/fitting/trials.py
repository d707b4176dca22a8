"""Trials of simulated cells whose parameters are drawn at random: what the search learns from.

Draw `index` of a round is a function of the seed, the round and the index alone, so that any
number of processes, in any order and after any restart, gives the same file.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np

from likeme_arm_sim.fitted import FITTED
from likeme_arm_sim.offline import lone_cell, settings_with, try_action
from likeme_arm_sim.scene import OBJECTS
from likeme_bringup.fitting.rows import Row

Values = Mapping[str, float]


class Draw(NamedTuple):
    """One set of parameters, and how one trial of each row ended (state numbers, by row name)."""

    round: int
    number: int
    values: dict[str, float]
    ends: dict[str, int]


def drawn_values(centre: Values, spread: float, rng: np.random.Generator) -> dict[str, float]:
    """Parameters about a centre: uniform in the searched ranges shrunk by `spread` (1: all)."""
    values = {}
    for name, parameter in FITTED.items():
        half = spread * (parameter.high - parameter.low) / 2
        low = min(max(centre[name] - half, parameter.low), parameter.high - 2 * half)
        values[name] = float(rng.uniform(low, low + 2 * half))
    return values


def one_draw(
    seed: int, number: int, index: int, centre: Values, spread: float, tried: list[Row]
) -> Draw:
    """One trial of every row with parameters drawn about `centre`."""
    rng = np.random.default_rng([seed, number, index])
    values = drawn_values(centre, spread, rng)
    seeds = dict(zip(map(str, tried), map(int, rng.integers(2**31, size=len(tried))), strict=True))
    ends = {}
    for name in OBJECTS:
        cell = lone_cell(name, settings_with(values))
        for row in (row for row in tried if row.name == name):
            state, _ = try_action(cell, name, row.x_i, row.action, seeds[str(row)])
            ends[str(row)] = int(state)
    return Draw(number, index, values, ends)


def run_round(
    path: Path,
    seed: int,
    number: int,
    count: int,
    centre: Values,
    spread: float,
    tried: list[Row],
    workers: int,
    on_progress: Callable[[int], None],
) -> None:
    """Add what is missing of a round's draws to the file."""
    done = {draw.number for draw in read(path) if draw.round == number}
    missing = [index for index in range(count) if index not in done]
    on_progress(len(done))
    _end_torn_line(path)
    # Physics clients do not survive a fork.
    with ProcessPoolExecutor(workers, get_context('spawn')) as pool, path.open('a') as file:
        jobs: list[Future[Draw]] = [
            pool.submit(one_draw, seed, number, index, centre, spread, tried) for index in missing
        ]
        for finished, job in enumerate(as_completed(jobs), len(done) + 1):
            file.write(json.dumps(job.result()._asdict()) + '\n')
            file.flush()
            on_progress(finished)


def read(path: Path) -> list[Draw]:
    """All complete draws of a file, in the order of round and index; none without the file."""
    return (
        sorted(_lines(path), key=lambda draw: (draw.round, draw.number)) if path.exists() else []
    )


def _end_torn_line(path: Path) -> None:
    """A search that was killed while it wrote must not swallow the next line."""
    if path.exists() and path.read_bytes()[-1:] not in (b'', b'\n'):
        with path.open('a') as file:
            file.write('\n')


def _lines(path: Path) -> Iterator[Draw]:
    for line in path.read_text().splitlines():
        try:
            yield Draw(**json.loads(line))
        except json.JSONDecodeError:
            # The torn end of a search that was killed while it wrote.
            continue
