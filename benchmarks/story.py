"""The demo with several seeds: completed or not, the reason if not, and the time.

`./scripts/bench.sh story [--json] [--seeds N]` (10). Each run is the whole demo with its own
processes. The bar on time is 90 s.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from report import Bar, publish

DEMO_TIMEOUT = 300.0


class DemoRun(NamedTuple):
    """One run of the demo. reason: the lines that say why it was not completed."""

    seed: int
    completed: bool
    seconds: float
    reason: str


def run_demo(seed: int, folder: Path) -> DemoRun:
    """Run the demo with one seed."""
    command = [sys.executable, '-m', 'likeme_bringup.demo', '--seed', str(seed)]
    begin = time.monotonic()
    done = subprocess.run(
        [*command, '--out', str(folder / str(seed))],
        capture_output=True,
        text=True,
        timeout=DEMO_TIMEOUT,
        check=False,
    )
    seconds = time.monotonic() - begin
    output = ' '.join(done.stdout.split())
    reason = '' if done.returncode == 0 else _reason(output)
    return DemoRun(seed, done.returncode == 0, seconds, reason)


def _reason(output: str) -> str:
    """The demo's explanation of the end, or its last characters."""
    for opening in ('The story stops here. ', ' not reached: '):
        if opening in output:
            return output.partition(opening)[2].partition(' What the ')[0]
    return output[-200:]


def main() -> None:
    """Run the demo with every seed and publish."""
    parser = argparse.ArgumentParser()
    parser.add_argument('--seeds', type=int, default=10)
    parser.add_argument('--json', action='store_true')
    seeds = parser.parse_args().seeds
    with tempfile.TemporaryDirectory() as folder:
        runs = [run_demo(seed, Path(folder)) for seed in range(1, seeds + 1)]
    bars = [
        Bar('completed', sum(run.completed for run in runs), None, 'runs', None, seeds, False),
        Bar('longest', max(run.seconds for run in runs), 90.0, 's', 'the user', seeds),
    ]
    rows = {
        f'seed {run.seed}': f'{run.seconds:.0f} s, {run.reason or "completed"}' for run in runs
    }
    publish('story', bars, rows)


if __name__ == '__main__':
    main()
