"""Gaze following: accuracy, coverage, the blindfold, and times, beside the authors' own code.

Accuracy: six agents (seeds 1 to 6) of 200 head movements each, 375 goals, five observations. Times
are processor time on one thread, which other load affects little; the 10,000 blindfold agents run
in two processes, and half of their processor time is reported.
The last figures compare the Gaussian answer with a million weighted samples of the exact posterior
on 20 goals. `--quick` uses 200 blindfold agents and two of the 20 goals.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

import report
from likeme_core.progress_bar import counted
from likeme_experiments.evaluation.blindfold_groups import (
    differs_from_zero,
    follows_more,
    group_score,
    group_turns,
)
from likeme_experiments.evaluation.gaze_accuracy import (
    GazeErrors,
    GazeTest,
    followed,
    gaze_accuracy,
    gaze_errors,
    gaze_test,
)
from likeme_experiments.evaluation.gaze_exact import exact_goal, gap
from likeme_experiments.reproductions.gaze import summary
from likeme_gaze import (
    Gaussian,
    GazeModel,
    forward_inference,
    goal_prior,
    known,
    reverse_inference,
)
from likeme_gaze.blindfold import FIGURE_GROUPS, InfantGroup
from likeme_gaze.simulation import SimulationSetup

QUICK = '--quick' in sys.argv[1:]
SEEDS, AGENTS, CHUNK = range(1, 7), (200 if QUICK else 10_000), 50
CASES, SAMPLES = (2 if QUICK else 20), 1_000_000
THEIRS = "the authors' code, Octave"
SETTING = SimulationSetup()
#: Medians and 90th percentiles of the bars, degrees.
ACCURACY = {'forward': (1.5, 3.9), 'reverse': (1.8, 5.0), 'following': (1.8, 5.0)}
PEERS = {
    'forward': '1.77 / 4.88, corrected 1.49 / 3.86',
    'reverse': '2.49 / 6.91, corrected 2.32 / 6.08',
    'following': '2.86 / 7.51, corrected 2.14 / 6.00',
}


def on_one_thread() -> None:
    """Restart this script with single-threaded libraries, before any has started threads."""
    single = {'OMP_NUM_THREADS': '1', 'OPENBLAS_NUM_THREADS': '1'}
    if any(os.environ.get(name) != value for name, value in single.items()):
        os.execve(sys.executable, sys.orig_argv, os.environ | single)


def seconds(what: str, work: Callable[[], object], times: int) -> float:
    """Median processor time of a call, s, after one to warm up."""
    work()
    spent = []
    for _ in counted(range(times), what, times, timed=True):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return float(np.median(spent))


def accuracy(errors: Sequence[GazeErrors]) -> Iterator[report.Bar]:
    """Errors after five observations, and the coverage of the goal's 95 % region."""
    pooled = summary(errors)
    count = len(errors) * len(errors[0].forward)
    for name, (median, tenth) in ACCURACY.items():
        found = pooled[name] if name == 'forward' else pooled[name][-1]
        peer = f'{THEIRS}: {PEERS[name]}'
        yield report.Bar(f'{name}: median |error|', found['median'], median, 'deg', peer, count)
        yield report.Bar(f'{name}: 90 % of |error|', found['p90'], tenth, 'deg', peer, count)
    share = 100 * pooled['coverage_95'][-1]
    theirs = f'{THEIRS}: over-confident'
    yield report.Bar(
        '95 % region covers the goal, at least', share, 93.0, '%', theirs, count, False
    )
    yield report.Bar('95 % region covers the goal, at most', share, 97.0, '%', theirs, count)


def times(model: GazeModel, test: GazeTest) -> Iterator[report.Bar]:
    """One inference of each kind, the whole run, and the training."""
    head, start = model.head, known([0.2])
    goal = Gaussian(np.array([300.0, 150.0]), np.diag([400.0, 200.0]))
    wide = SETTING.mentor.belief_from_parent(goal_prior(SETTING.agent, SETTING.mentor))
    final = np.array([0.5, 350.0])
    forward = 1e3 * seconds(
        'forward', lambda: forward_inference(head, known(goal.mean), start), 300
    )
    believed = 1e3 * seconds('uncertain goal', lambda: forward_inference(head, goal, start), 300)
    reverse = 1e3 * seconds('reverse', lambda: reverse_inference(head, wide, start, final), 300)
    yield report.Bar('one forward inference, n = 200', forward, 1.0, 'ms', f'{THEIRS}: 14.4', 300)
    yield report.Bar('one reverse inference, n = 200', reverse, 1.5, 'ms', f'{THEIRS}: 16.7', 300)
    yield report.Bar('the same for an uncertain goal', believed, None, 'ms', None, 300)
    run = seconds('following', lambda: gaze_errors(head, test), 3)
    theirs = f'{THEIRS}: 64 to 70'
    yield report.Bar('375 goals x 5 observations, one core', run, 3.0, 's', theirs, 3)
    train = seconds('training', lambda: GazeModel.simulated(1), 5)
    yield report.Bar('training both, n = 200', train, 2.0, 's', f'{THEIRS}: 3.2, corrected 6.3', 5)


def timed_turns(task: tuple[InfantGroup, int]) -> tuple[NDArray[np.float64], float]:
    """Turns of CHUNK agents of a group, and the processor time they took."""
    start = time.process_time()
    group, first = task
    return group_turns(1, group, CHUNK, first), time.process_time() - start


def blindfold(notes: dict[str, Any]) -> Iterator[report.Bar]:
    """Fig 6 with 60 agents; times and mean scores with AGENTS agents."""
    each = -(-AGENTS // (len(FIGURE_GROUPS) * CHUNK))
    tasks = [(group, CHUNK * k) for group in FIGURE_GROUPS for k in range(each)]
    begun = time.monotonic()
    with ProcessPoolExecutor(2) as pool:
        results = list(counted(pool.map(timed_turns, tasks), 'blindfold', len(tasks)))
    notes['blindfold agents, wall time'] = f'{time.monotonic() - begun:.0f} s on 2 processes'
    turned = {
        group.name: np.concatenate(
            [r[0] for r, t in zip(results, tasks, strict=True) if t[0] == group]
        )
        for group in FIGURE_GROUPS
    }
    few = {name: found[:20] for name, found in turned.items()}
    p = max(follows_more(few[name], few['opaque']) for name in ('baseline', 'windowed'))
    both = follows_more(np.concatenate([few['baseline'], few['windowed']]), few['opaque'])
    yield report.Bar('following groups above opaque, 60 agents: p', both, 1e-6, '', None, 60)
    notes['each following group above opaque, 40 agents'] = f'p = {p:.1e}'
    still = differs_from_zero(few['opaque'])
    yield report.Bar('opaque differs from 0: p', still, 0.05, '', None, 20, False)
    theirs = {'baseline': '2.08, corrected 3.40', 'windowed': '2.14, 3.67', 'opaque': '0.00, 0.05'}
    for name, found in turned.items():
        score = group_score(found)
        peer = f'{THEIRS}: {theirs[name]}'
        yield report.Bar(f'{name}: mean score at 30 deg', score.mean, None, '', peer, score.agents)
    spent = sum(r[1] for r in results) / 2
    total = sum(map(len, turned.values()))
    yield report.Bar(
        f'{total} agents on two cores', spent, 120.0 * total / 10_000, 's', 'a requirement', total
    )


def exact_gap(case: int) -> dict[str, float]:
    """The Gaussian answer beside the exact posterior on one goal of the test region."""
    model, test = GazeModel.simulated(1), gaze_test(np.random.default_rng([1, 1]))
    index = case * len(test.goal) // CASES + 9
    here = slice(index, index + 1)
    one = GazeTest(
        test.goal[here], test.agent_start[here], test.mentor_start[here], test.final[:, here]
    )
    *_, last = followed(model.head, one)
    answer = Gaussian(last.mentor.mean[0, :2], last.mentor.covariance[0, :2, :2])
    prior = SETTING.mentor.belief_from_parent(goal_prior(SETTING.agent, SETTING.mentor))
    start, final = float(one.mentor_start[0]), one.final[:, 0]
    rng = np.random.default_rng([1, 3, case])
    exact = exact_goal(rng, model.head, prior, start, final, answer, SAMPLES)
    return gap(answer, exact.belief) | {'effective': exact.effective}


def exact_differences() -> Iterator[report.Bar]:
    """Differences between the Gaussian and the exact posterior of the learned model."""
    with ProcessPoolExecutor(2) as pool:
        gaps = list(counted(pool.map(exact_gap, range(CASES)), 'exact goals', CASES))
    peer = f'{SAMPLES:,} weighted samples'
    for key, words, unit in (
        ('shift', 'mean off the exact one: greatest', 'exact std'),
        ('kl', 'KL(exact || answer): greatest', 'nat'),
    ):
        worst = max(g[key] for g in gaps)
        yield report.Bar(words, worst, None, unit, peer, CASES)
    ratio = float(np.median([g['widths'] for g in gaps]))
    yield report.Bar('width over the exact one: median', ratio, None, '', peer, CASES)
    least = min(g['effective'] for g in gaps)
    yield report.Bar('effective samples: fewest', least, None, '', peer, CASES, False)


def main() -> None:
    """Measure and publish."""
    on_one_thread()
    parser = report.option_parser('gaze')
    parser.add_argument('--quick', action='store_true', help='few agents and cases')
    parser.parse_args()
    notes: dict[str, Any] = {'seeds': list(SEEDS), 'load at start': os.getloadavg()[0]}
    with ProcessPoolExecutor(2) as pool:
        errors = list(counted(pool.map(gaze_accuracy, SEEDS), 'seeds', len(SEEDS)))
    shares = [100 * float(each.covered[-1].mean()) for each in errors]
    notes['coverage per seed'] = ', '.join(f'{share:.1f} %' for share in shares)
    bars = [*accuracy(errors)]
    bars += times(GazeModel.simulated(1), gaze_test(np.random.default_rng([1, 1])))
    bars += blindfold(notes)
    bars += exact_differences()
    report.publish('gaze', bars, notes)


if __name__ == '__main__':
    main()
