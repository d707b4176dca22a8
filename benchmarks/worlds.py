"""Random worlds through model, perception, a demonstration, a decision and a simulated act.

`./scripts/bench.sh worlds [--json] [--n N] [--first SEED]` (200 from 0; about 6 s each). Crashes
are printed in full.
"""

from __future__ import annotations

import sys
from statistics import mean

from likeme_core.progress_bar import counted
from report import Bar, option_parser, publish, whole_number
from worlds_parts.world_run import WorldRun, run_world

REQUIREMENT = 'any valid world'


def bars_of(runs: list[WorldRun]) -> list[Bar]:
    """The figures of all worlds."""
    count = len(runs)
    shown = [run.understood for run in runs if run.understood is not None]
    seen, objects = sum(run.seen for run in runs), sum(run.objects for run in runs)
    whole = [run for run in runs if not run.failure]
    return [
        Bar('crashes', sum(bool(run.failure) for run in runs), 0, 'worlds', REQUIREMENT, count),
        Bar(
            'decisions that follow from the model', mean(run.consistent for run in runs), 1,
            'of 1', REQUIREMENT, count, False,
        ),
        Bar('states seen right', seen / max(1, objects), 0.95, 'of 1', 'ours', objects, False),
        Bar('demonstrations understood', mean(shown or [0]), None, 'of 1', None, len(shown)),
        Bar('motions completed', mean(run.moved for run in runs), None, 'of 1', None, count),
        Bar('goals reached', mean(run.reached for run in runs), None, 'of 1', None, count),
        Bar('a world', mean(run.seconds for run in whole or runs), None, 's', None, count),
    ]  # fmt: skip


def main() -> None:
    """Run every world and publish."""
    parser = option_parser('worlds')
    parser.add_argument('--n', type=whole_number, default=200)
    parser.add_argument('--first', type=whole_number, default=0)
    options = parser.parse_args()
    if options.n < 1 or options.first < 0:
        parser.error(f'expected 1 world or more from seed 0 on, got {options.n}, {options.first}')
    runs = []
    seeds = range(options.first, options.first + options.n)
    for seed in counted(seeds, 'worlds', options.n):
        run = run_world(seed)
        print(run._replace(failure=run.failure[-300:]), file=sys.stderr, flush=True)
        runs.append(run)
    if not publish(
        'worlds', bars_of(runs), {f'seed {r.seed}': r.failure for r in runs if r.failure}
    ):
        sys.exit(1)


if __name__ == '__main__':
    main()
