"""People's resets in a campaign on a real table: planned, and when asked for each trial.

    ./scripts/bench.sh resets [--seeds N] [--repetitions N] [--json]

The world is the real robot's table, in 540 trials, from which the end of each trial is drawn. What
objects do to each other is not in it. Every pair is tried `--repetitions` times (10), by N seeds
(100). Exit code 1 if a bar is missed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

import numpy as np

from likeme_core.paper_world import WORLD
from likeme_experiments.evaluation.people_resets import (
    CampaignRun,
    SimulatedTable,
    asking_each_time,
    asking_for_one_at_a_time,
    planned_campaign,
)
from likeme_inference.tabletop.model_file import shipped
from report import Bar, option_parser, publish, whole_number

Strategy = Callable[[SimulatedTable, int, int], CampaignRun]


def runs(strategy: Strategy, repetitions: int, seeds: int) -> list[CampaignRun]:
    """One campaign a seed, on the same tables for every strategy."""
    truth = {name: model.transition for name, model in shipped().objects.items()}
    tables = (
        SimulatedTable(WORLD, truth, np.random.default_rng([seed, 0])) for seed in range(seeds)
    )
    return [strategy(table, repetitions, seed) for seed, table in enumerate(tables)]


def per_100(runs: Sequence[CampaignRun], what: str, of: str = 'trials') -> float:
    """A number of the runs per 100 trials, or per 100 of something else."""
    total = sum(getattr(run, what) for run in runs)
    return float(100 * total / sum(getattr(run, of) for run in runs))


def main() -> int:
    """Measure and publish; the exit code."""
    parser = option_parser('resets')
    parser.add_argument('--seeds', type=whole_number, default=100)
    parser.add_argument('--repetitions', type=whole_number, default=10)
    given = parser.parse_args()
    planned = runs(planned_campaign, given.repetitions, given.seeds)
    asking = runs(asking_each_time, given.repetitions, given.seeds)
    one = runs(asking_for_one_at_a_time, given.repetitions, given.seeds)
    n = sum(run.trials for run in planned)

    def bar(
        name: str, measured: float, limit: float | None = None, peer: str | None = None
    ) -> Bar:
        return Bar(name, measured, limit, '', peer, n)

    each = per_100(asking, 'resets')
    resets, requests = per_100(planned, 'resets'), per_100(planned, 'requests')
    least = per_100(planned, 'unavoidable')
    bars = [
        bar('resets per 100 trials, planned', resets, each / 2, 'half of asking each time'),
        bar('requests per 100 trials, planned', requests, each / 4, 'a quarter of it'),
        bar('resets per 100 trials, asking each time', each),
        bar('the same, any trial at hand, one object at a time', per_100(one, 'resets')),
        bar('resets to those that no order saves', resets / least, 1.1),
        bar('planned: resets per 100 motions', per_100(planned, 'resets', 'motions')),
        bar('asking: resets per 100 motions', per_100(asking, 'resets', 'motions')),
        bar('planned: trials beyond the plan, per 100', per_100(planned, 'transports'), 5.0),
    ]
    return 0 if publish('resets', bars) else 1


if __name__ == '__main__':
    sys.exit(main())
