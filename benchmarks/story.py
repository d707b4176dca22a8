"""The demo, seed by seed: completed or not, why not, and how long it took.

`./scripts/bench.sh story [--json] [--seeds N]`: ten seeds unless told otherwise. Every run is the
whole demo with its own processes. The bar on time is the 90 s a user should at most have to wait.
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

PATIENCE = 300.0


class Told(NamedTuple):
    """How one telling of the story went. why: the telling lines when it was not completed."""

    seed: int
    completed: bool
    seconds: float
    why: str


def tell(seed: int, folder: Path) -> Told:
    """Run the demo with one seed."""
    command = [sys.executable, '-m', 'likeme_bringup.demo', '--seed', str(seed)]
    begin = time.monotonic()
    done = subprocess.run(
        [*command, '--out', str(folder / str(seed))],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    seconds = time.monotonic() - begin
    words = ' '.join(done.stdout.split())
    why = '' if done.returncode == 0 else _reason(words)
    return Told(seed, done.returncode == 0, seconds, why)


def _reason(words: str) -> str:
    """What the demo said about the end of the story."""
    for opening in ('The story stops here. ', ' not reached: '):
        if opening in words:
            return words.partition(opening)[2].partition(' What the ')[0]
    return words[-200:]


def main() -> None:
    """Tell the story with every seed and publish."""
    parser = argparse.ArgumentParser()
    parser.add_argument('--seeds', type=int, default=10)
    parser.add_argument('--json', action='store_true')
    seeds = parser.parse_args().seeds
    with tempfile.TemporaryDirectory() as folder:
        runs = [tell(seed, Path(folder)) for seed in range(1, seeds + 1)]
    bars = [
        Bar('completed', sum(run.completed for run in runs), None, 'stories', None, seeds, False),
        Bar('longest', max(run.seconds for run in runs), 90.0, 's', 'the user', seeds),
    ]
    rows = {f'seed {run.seed}': f'{run.seconds:.0f} s, {run.why or "completed"}' for run in runs}
    publish('story', bars, rows)


if __name__ == '__main__':
    main()
