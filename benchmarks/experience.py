"""Offline learning: trials a second with one and two workers, and concurrent writers of a store.

A trial is reset, perceive, act, perceive, with the sensor model. `--trials N` (162): of each run;
the rate excludes the first 54, in which cells are made. `--writers N` (4): processes that record
250 trials each, one transaction a trial.
"""

from __future__ import annotations

import math
import multiprocessing
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import NamedTuple

import psutil
from rich.console import Console

from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT, PUSH_LEFT, WORLD
from likeme_core.progress_bar import ProgressBar
from likeme_experiments.learning.offline import learn_locally
from likeme_experiments.learning.robot_identity import simulated_robot
from likeme_inference.experience.campaign import Campaign, Progress
from likeme_inference.experience.exploration_policy import Systematic
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Pair, Trial, TrialKey
from report import Bar, option_parser, publish, whole_number

EACH = 250
PAIRS = len(WORLD.states) * len(WORLD.actions)


class CampaignRun(NamedTuple):
    """One campaign: trials per s without and with start-up, processor s a trial, and results.

    Processor time is that of the workers without start-up; other load affects it less.
    """

    rate: float
    overall: float
    processor: float
    ends: tuple[tuple[str, int], ...]


@contextmanager
def store_at(path: Path) -> Iterator[ExperienceStore]:
    """A store in a temporary folder."""
    with closing(ExperienceStore(str(path), WORLD)) as store:
        yield store


def run(workers: int, repetitions: int, folder: Path) -> CampaignRun:
    """Run a campaign."""
    warm_up = PAIRS * len(WORLD.objects)
    campaign = Campaign(
        WORLD, simulated_robot(WORLD), 'offline-1', 1, WORLD.objects, Systematic(repetitions)
    )
    marks: list[tuple[float, float]] = []
    bar = ProgressBar(
        Console(stderr=True), f'trials, {workers} at a time', warm_up * repetitions, 0, math.inf,
        timed=True,
    )  # fmt: skip

    def mark(_: Trial) -> None:
        marks.append((time.monotonic(), _children_time()))
        bar.advance('')

    began = time.monotonic()
    with store_at(folder / f'{workers}.sqlite') as store, bar.shown():
        learn_locally(Progress(campaign, store), store, workers, mark)
        ends = tuple(sorted((t.key.identity, int(t.x_f)) for t in store.trials()))
    ended = time.monotonic()
    (first, first_used), (last, last_used) = marks[warm_up - 1], marks[-1]
    trials = len(marks) - warm_up
    steady, processor = trials / (last - first), (last_used - first_used) / trials
    return CampaignRun(steady, len(marks) / (ended - began), processor, ends)


def _children_time() -> float:
    """Processor s of the running child processes."""
    used = [child.cpu_times() for child in psutil.Process().children()]
    return float(sum(times.user + times.system for times in used))


def _write(place: str, writer: int) -> None:
    """Record trials one by one; the next writer records half of them too."""
    with closing(ExperienceStore(place, WORLD)) as store:
        for number in range(EACH):
            key = TrialKey(
                'bench', 'write', Pair('pear', LEFT, PUSH_LEFT),
                writer * EACH // 2 + number,
            )  # fmt: skip
            store.record([Trial(key, LEFT, MotionOutcome.COMPLETED, 0, 'bench', 0)])


def write(writers: int, folder: Path) -> tuple[float, int]:
    """Records per s of concurrent writers, and how many trials are missing or doubled."""
    place = folder / 'writers.sqlite'
    with store_at(place) as store:
        context = multiprocessing.get_context('spawn')
        processes = [context.Process(target=_write, args=(str(place), n)) for n in range(writers)]
        began = time.monotonic()
        for process in processes:
            process.start()
        for process in processes:
            process.join()
        seconds = time.monotonic() - began
        kept = [trial.key.repetition for trial in store.trials()]
    expected = EACH + (writers - 1) * (EACH // 2)
    return writers * EACH / seconds, abs(len(kept) - expected) + len(kept) - len(set(kept))


def main() -> None:
    """Measure and publish."""
    parser = option_parser('experience')
    parser.add_argument('--trials', type=whole_number, default=162)
    parser.add_argument('--writers', type=whole_number, default=4)
    given = parser.parse_args()
    repetitions = max(2, round(given.trials / PAIRS / len(WORLD.objects)))
    trials = repetitions * PAIRS * len(WORLD.objects)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        one, two = run(1, repetitions, folder), run(2, repetitions, folder)
        records, wrong = write(given.writers, folder)
    other = sum(a != b for a, b in zip(one.ends, two.ends, strict=True))
    bars = [
        Bar('trials, two workers', two.rate, 4.0, '1/s', n=trials, at_most=False),
        Bar('the same, target', two.rate, 20.0, '1/s', n=trials, at_most=False),
        Bar('the same with start-up', two.overall, None, '1/s', n=trials),
        Bar('trials, one worker', one.rate, None, '1/s', n=trials),
        Bar('two workers to one', two.rate / one.rate, 1.8, '', n=trials, at_most=False),
        Bar(
            'the same by processor time',
            2 * one.processor / two.processor,
            1.8,
            '',
            n=trials,
            at_most=False,
        ),
        Bar(
            'trials, two cores to themselves, by processor time',
            2 / two.processor,
            4.0,
            '1/s',
            n=trials,
            at_most=False,
        ),
        Bar('processor time a trial, one worker', one.processor, None, 's', n=trials),
        Bar('processor time a trial, two workers', two.processor, None, 's', n=trials),
        Bar('trials with another result with two', other, 0, '', n=trials),
        Bar(f'records of {given.writers} writers', records, None, '1/s', n=given.writers * EACH),
        Bar('trials lost or doubled by them', wrong, 0, '', n=given.writers * EACH),
    ]
    publish('experience', bars)


if __name__ == '__main__':
    main()
