"""Joint goals shown and imitated in the simulated cell, `--seeds` runs (100).

A run is imitation/joint_imitation.py: a person acts, fails and corrects before the camera; the
robot imitates in sequential mode and is helped when it asks. Intervals are exact, at 95 %.
"""

from __future__ import annotations

import multiprocessing
from argparse import Namespace
from concurrent.futures import ProcessPoolExecutor

from likeme_core.progress_bar import counted
from likeme_core.world import load_world
from likeme_experiments.evaluation.intervals import exact_interval
from likeme_experiments.imitation.joint_imitation import JointRun, joint_run
from likeme_inference.tabletop.model_file import shipped
from report import Bar

RUNS, PROCESSES = 100, 2


def bars(options: Namespace) -> list[Bar]:
    """Shares of the runs, each with its bounds."""
    count = options.seeds or RUNS
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(PROCESSES, mp_context=context) as pool:
        runs = list(counted(pool.map(_run, range(count)), 'demonstrations in the cell', count))
    failing = [run for run in runs if run.failed]
    right = [run for run in runs if run.right]
    asked = [run for run in runs if run.asked]
    return [
        *_share('joint goals in the cell: goal right', len(right), runs),
        *_share('of these with failed acts', sum(run.right for run in failing), failing),
        *_share('table as it was meant in the end', sum(run.reached for run in runs), runs),
        *_share('of these with the goal right', sum(run.reached for run in right), right),
        *_share('asked for help', len(asked), runs),
    ]


def _run(seed: int) -> JointRun:
    return joint_run(load_world(), shipped(), seed)


def _share(name: str, hits: int, runs: list[JointRun]) -> list[Bar]:
    if not runs:
        return []
    low, high = exact_interval(hits, len(runs))
    bounds = f'{low:.2f} to {high:.2f}'
    return [Bar(f'{name} ({bounds})', hits / len(runs), None, 'of 1', None, len(runs))]
