"""Live learning while nodes are killed: trials lost and doubled, and hangs.

`--trials N` (54): to make. `--kills N` (6): SIGKILL of arm driver, perception, inference and
learner in turn, each at a random time after the first trial since the last kill. `--seed N` (1):
of the campaign and the times. `--store FILE`: keep the trials there and continue with those in it.
`--minutes N`: time limit. The cell runs without real-time pacing.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, closing
from itertools import cycle
from pathlib import Path

import numpy as np
import psutil
from domain_coordinator import domain_id
from rich.console import Console

from likeme_core.paper_world import WORLD
from likeme_core.processes import die_with_parent
from likeme_core.progress_bar import ProgressBar
from likeme_experiments.learning.campaigns import PolicyName, campaign_of
from likeme_inference.experience.store import ExperienceStore
from report import Bar, option_parser, publish, whole_number

ROBOT = 'live-bench'
VICTIMS = 'arm_driver_node', 'perception_node', 'inference_node', 'learner'
#: s from a trial to a kill, mean; s without a new trial that count as a hang; s between polls.
MEAN_PAUSE, HANG, POLL_PERIOD = 6.0, 300.0, 0.5


class Learner:
    """`learn.sh --with-cell` as a process that can be restarted."""

    def __init__(self, words: list[str], log: Path) -> None:
        self._command = [
            sys.executable,
            '-m',
            'likeme_experiments.commands.learn',
            '--with-cell',
            *words,
        ]
        self._log = log.open('ab')
        self.starts = 0
        self.start()

    def start(self) -> None:
        """Start the process."""
        self.starts += 1
        self.process = subprocess.Popen(
            self._command,
            stdout=self._log,
            stderr=self._log,
            preexec_fn=die_with_parent(os.getpid()),
        )

    def kill(self, victim: str) -> bool:
        """Kill -9 the learner or a node of its cell; True if it was running."""
        if victim == 'learner':
            self.process.kill()
            self.process.wait()
            return True
        try:
            children = psutil.Process(self.process.pid).children(recursive=True)
            found = [c for c in children if any(victim in word for word in c.cmdline())]
            for child in found:
                child.kill()
        except psutil.NoSuchProcess:
            return False
        return bool(found)


def main() -> None:
    """Measure and publish."""
    parser = option_parser('live_learning')
    parser.add_argument('--trials', type=whole_number, default=54)
    parser.add_argument('--kills', type=whole_number, default=6)
    parser.add_argument('--seed', type=whole_number, default=1)
    parser.add_argument('--store', type=Path)
    parser.add_argument('--minutes', type=float, default=np.inf)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, domain_id() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        place = given.store or Path(name) / 'experience.sqlite'
        publish('live_learning', measure(given, place, place.with_suffix('.log')))


def measure(given: argparse.Namespace, place: Path, log: Path) -> list[Bar]:
    """Run the campaign to its end with kills at random times."""
    rng, victims = np.random.default_rng(given.seed), cycle(VICTIMS)
    campaign = campaign_of(
        WORLD, 'live', ROBOT, given.seed, WORLD.objects, PolicyName.RANDOM, 10, given.trials
    )  # fmt: skip
    planned = {key.identity for key in campaign.plan()}
    words = ['--policy', 'random', '--trials', str(given.trials), '--seed', str(given.seed)]
    words += ['--robot', ROBOT, '--store', str(place)]
    began, killed, gone, hangs = time.monotonic(), 0, 0, 0
    with ExitStack() as stack:
        store = stack.enter_context(closing(ExperienceStore(str(place), WORLD)))
        at_first = known = store.identities(ROBOT, campaign.name)
        bar = ProgressBar(Console(stderr=True), 'trials', given.trials, len(known), math.inf)
        stack.enter_context(bar.shown())
        learner = Learner(words, log)
        news, due = time.monotonic(), np.inf
        last = began + 60 * given.minutes
        while learner.process.poll() != 0 and not hangs and time.monotonic() < last:
            time.sleep(POLL_PERIOD)
            now, found = time.monotonic(), store.identities(ROBOT, campaign.name)
            gone += len(known - found)
            if found != known:
                news, known = now, found
                bar.reach(len(known))
                due = min(due, now + rng.exponential(MEAN_PAUSE))
            hangs += now - news > HANG
            if killed < given.kills and now > due:
                victim, due = next(victims), np.inf
                killed += learner.kill(victim)
                print(f'{killed}: kill -9 {victim} after {len(known)} trials', file=sys.stderr)
            if learner.process.poll() not in (None, 0):
                learner.start()
        if learner.process.poll() is None:
            learner.process.terminate()
            learner.process.wait()
        trials = list(store.trials(ROBOT, campaign.name))
    made = len(known) - len(at_first)
    seconds = time.monotonic() - began
    return [
        Bar('trials recorded', len(planned & known), given.trials, '', at_most=False),
        Bar('trials lost that were recorded', gone, 0, '', n=killed),
        Bar('trials doubled or not planned', len(trials) - len(planned & known), 0, '', n=killed),
        Bar('hangs', hangs, 0, '', n=len(known)),
        Bar('kills', killed, given.kills, '', at_most=False),
        Bar('starts of the learner', learner.starts, None, ''),
        Bar('trials a minute', made / seconds * 60, None, '1/min', n=made),
    ]


if __name__ == '__main__':
    main()
