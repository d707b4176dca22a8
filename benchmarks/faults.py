"""Faults injected into the cell at every phase of a story, while all policies are checked.

    ./scripts/bench.sh faults [--n N] [--live M] [--soak K] [--seed S] [--json]

Offline (N faults, default 10,000): the real inference node and hold keeper, decision log,
journal of motions and hold monitor, in simulated time on a simulated graph, with a simulated arm,
camera, person and operators. Live (M faults, default 20): the cell's processes under their
supervisor, on a ROS domain of their own and, for root where network namespaces are allowed, on
three hosts of which one may be cut off. Soak (--soak K stories in one cell, default 0): memory.
Exit code 1 if a bar is missed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from faults_parts import results
from faults_parts.results import CellResult, Trouble
from report import Bar, option_parser, publish, whole_number
from virtual_hosts.hosts import own_network

#: Troubles that are reported of each kind.
SHOWN = 20
CAMPAIGN = 'the campaign'


def offline_bars(found: CellResult) -> list[Bar]:
    """What the offline campaign is held against."""
    count = sum(found.faults.values())
    late = [seconds for seconds in found.recovery if seconds > 0] or [0.0]
    return [
        Bar('offline: violations', len(found.violations), 0, 'violations', CAMPAIGN, count),
        Bar('offline: unfinished stories', len(found.unfinished), 0, 'stories', CAMPAIGN, count),
        Bar('offline: lost questions', len(found.lost_questions), 0, 'questions', CAMPAIGN, count),
        Bar('offline: lost log entries', len(found.lost_entries), 0, 'entries', CAMPAIGN, count),
        *(
            Bar(
                f'offline: fault to outcome, p{p}', float(np.percentile(late, p)), None,
                's simulated', None, len(late),
            )
            for p in (50, 99)
        ),
    ]  # fmt: skip


def soak_bars(broken: int, memory: list[float], stories: int) -> list[Bar]:
    """What the soak is held against: what is kept at the beginning is kept for good."""
    growth = 100 * (memory[-1] / memory[1] - 1) if len(memory) == 10 else float('nan')
    return [
        Bar('soak: violations', broken, 0, 'violations', CAMPAIGN, stories),
        Bar('soak: memory from a fifth to the end', growth, 5, '%', CAMPAIGN, stories),
    ]


def troubles(found: tuple[list[Trouble], ...]) -> list[str]:
    """What went wrong, for the notes."""
    return [
        f'cell {t.cell}, story {t.story}: {t.what} ({t.fault})'
        for each in found
        for t in each[:SHOWN]
    ]


def main() -> int:
    """Run both campaigns and publish."""
    parser = option_parser('faults', usage=__doc__)
    parser.add_argument('--n', type=whole_number, default=10_000)
    parser.add_argument('--live', type=whole_number, default=20)
    parser.add_argument('--soak', type=whole_number, default=0)
    parser.add_argument('--seed', type=whole_number, default=1)
    given = parser.parse_args()
    if given.live > 0:
        own_network()
    bars: list[Bar] = []
    notes: dict[str, Any] = {}
    if given.n > 0:
        found, wall = results.run(given.n, given.seed)
        bars += offline_bars(found)
        notes['offline'] = f'{wall:.0f} s, {1000 * wall / given.n:.1f} ms a fault'
        notes['offline faults'] = dict(sorted(found.faults.items()))
        notes['offline troubles'] = troubles(found[2:6])
    if given.soak > 0:
        broken, memory = results.soak(given.soak, given.seed)
        bars += soak_bars(broken, memory, given.soak)
        notes['soak'] = [f'{each:.1f} MiB' for each in memory]
    if given.live > 0:
        from faults_parts import live

        more, said = live.measure(given.live, given.seed)
        bars += more
        notes |= said
    return 0 if publish('faults', bars, notes) else 1


if __name__ == '__main__':
    raise SystemExit(main())
