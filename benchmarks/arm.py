"""The driver of a real arm against a stand-in robot with controller faults, over DDS.

    ./scripts/bench.sh arm [--n N] [--seed S] [--arm NAME] [--world WORLD] [--patience F]
    ./scripts/bench.sh arm --part stops [--arm NAME]

N seeded acts (default 200, about 8 s each) of all six actions in the paper's world, in three of
ten with other things on the table; nine of ten are drawn with a fault: the controller drops,
aborts, stalls, slows or delays a trajectory, a joint is pushed off its way, joint_states stay
away, a person holds or cancels. Processes: robot_stand_in, hold_keeper, arm_driver. Exit code 1
if a bar is missed.

Stops are those of the driver in simulated time against the stand-in's controller alone: holds at
seven moments of the motion from home over the table, at full and half speed, by messages that come
up to 0.5 s late.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from arm_parts.acts import MOVED, NONE, ActResult, carry_out, draw_act
from arm_parts.late_messages import Course, late_stops
from arm_parts.live_arm import live_arm
from likeme_arm.real_arm.arm_config import load_arm_config, shipped_configs
from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import WORLD
from likeme_core.progress_bar import counted
from report import Bar, option_parser, publish, whole_number

ISSUE = 'requirement'
SMALL = Path(__file__).with_name('arm_parts') / 'small_table.yaml'


def share(found: Iterable[bool]) -> float:
    """Share of what is true; NaN of nothing."""
    values = list(found)
    return sum(values) / len(values) if values else float('nan')


def bars(results: list[ActResult], report: dict[str, object]) -> list[Bar]:
    """What is held against the acts."""
    count = len(results)
    collisions, violations = (report[k] for k in ('collisions', 'violations'))
    assert isinstance(collisions, dict)
    assert isinstance(violations, dict)
    stopped = [r for r in results if not np.isnan(r.rest)]
    after = sum(r.after_hold > MOVED for r in stopped)
    completed = [r for r in results if r.outcome is MotionOutcome.COMPLETED]
    clear = [r for r in results if r.act.fault == NONE]
    rests = [r.rest for r in stopped] or [0.0]
    return [
        Bar('pairs of things that touched', len(collisions), 0, 'pairs', ISSUE, count),
        Bar('limits that were broken', len(violations), 0, 'limits', ISSUE, count),
        Bar('motions after a hold or cancel', after, 0, 'acts', ISSUE, len(stopped)),
        Bar('acts without one outcome', sum(r.outcome is None for r in results), 0, 'acts', ISSUE,
            count),
        Bar('hold or cancel to rest, greatest', max(rests), None, 's', None, len(stopped)),
        Bar('completed without a fault', share(r in completed for r in clear), None, 'share',
            None, len(clear)),
        Bar('object arrived where completed', share(r.arrived for r in completed), None, 'share',
            None, len(completed)),
        Bar('an act', float(np.median([r.seconds for r in results])), None, 's', None, count),
    ]  # fmt: skip


def stops(arm: str) -> int:
    """Late stops."""
    found: dict[tuple[float, float], list[Course]] = {}
    for speed, delay, course in late_stops(load_arm_config(arm)):
        found.setdefault((speed, delay), []).append(course)
    every = [course for courses in found.values() for course in courses]
    bars = [
        Bar('greatest share of a speed limit', max(c.speed for c in every), 1.0, '', ISSUE,
            len(every)),
        Bar('greatest share of an acceleration limit', max(c.acceleration for c in every), 1.0, '',
            ISSUE, len(every)),
        Bar('greatest way back', max(c.back for c in every), None, 'rad', None, len(every)),
    ]  # fmt: skip
    notes = {
        f'speed {speed:g}, {delay:g} s late: hold to rest (s), way after it (rad), at most': [
            round(max(c.rest for c in courses), 2), round(max(c.way for c in courses), 2),
        ]
        for (speed, delay), courses in found.items()
    }  # fmt: skip
    return 0 if publish('arm', bars, notes) else 1


def main() -> int:
    """Run the acts, or the stops."""
    parser = option_parser('arm', description=__doc__)
    parser.add_argument('--n', type=whole_number, default=200)
    parser.add_argument('--seed', type=whole_number, default=1)
    parser.add_argument(
        '--patience', type=float, default=1.0, help='factor on time-outs, for a loaded machine'
    )
    parser.add_argument('--arm', choices=shipped_configs(), default='panda')
    parser.add_argument(
        '--world', default=WORLD.name, help='name or file; small_table: that for the SO-101'
    )
    parser.add_argument('--interface', choices=('auto', 'action', 'topic'), default='topic')
    parser.add_argument('--part', choices=('acts', 'stops'), default='acts')
    parser.add_argument('--verbose', action='store_true', help='each act, on standard error')
    given = parser.parse_args()
    if given.part == 'stops':
        return stops(given.arm)
    results = []
    source = str(SMALL) if given.world == SMALL.stem else given.world
    how = {'arm': given.arm, 'controller_interface': given.interface}
    with live_arm(given.patience, world=source, **how) as live:
        for number in counted(range(given.n), 'acts', given.n):
            result = carry_out(live, draw_act(live.world, given.seed * 100_000 + number))
            results.append(result)
            if given.verbose:
                outcome = 'NONE' if result.outcome is None else result.outcome.name
                print(
                    f'{number} {result.act.action} {result.act.object}, {result.act.fault} '
                    f'{result.act.amount:.2f}: {outcome}: {result.message} At rest after '
                    f'{result.rest:.2f} s. {live.report}',
                    file=sys.stderr, flush=True,
                )  # fmt: skip
        report = dict(live.report)
    outcomes = Counter(
        f'{r.act.fault}: {"NONE" if r.outcome is None else r.outcome.name}' for r in results
    )
    notes = {
        **how,
        'world': given.world,
        'patience': given.patience,
        'outcomes by fault': dict(sorted(outcomes.items())),
        'collisions': report['collisions'],
        'violations': report['violations'],
        'greatest share of a speed limit': report['fastest'],
        'greatest share of an acceleration limit': report['hardest'],
        'sentences': dict(Counter(r.message for r in results).most_common(30)),
    }
    return 0 if publish('arm', bars(results, report), notes) else 1


if __name__ == '__main__':
    sys.exit(main())
