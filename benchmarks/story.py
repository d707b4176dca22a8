"""The demo with several seeds: completed or not, the reason if not, and the time.

`./scripts/bench.sh story [--json] [--seeds N] [--world W]` (10, chung2015). Each run is the whole
demo with its own processes. The bar on time is 90 s.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from likeme_core.progress_bar import counted
from report import Bar, option_parser, publish, whole_number

DEMO_TIMEOUT = 300.0


class DemoRun(NamedTuple):
    """One run of the demo. reason: the lines that say why it was not completed."""

    seed: int
    completed: bool
    seconds: float
    reason: str


def run_demo(seed: int, world: str, folder: Path) -> DemoRun:
    """Run the demo of a world with one seed."""
    options = ['--seed', str(seed), '--world', world]
    command = [sys.executable, '-m', 'likeme_bringup.demo', *options]
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
    parser = option_parser('story')
    parser.add_argument('--seeds', type=whole_number, default=10)
    parser.add_argument('--world', default='chung2015')
    given = parser.parse_args()
    seeds = given.seeds
    with tempfile.TemporaryDirectory() as folder:
        drawn = counted(range(1, seeds + 1), 'stories', seeds)
        runs = [run_demo(seed, given.world, Path(folder)) for seed in drawn]
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
