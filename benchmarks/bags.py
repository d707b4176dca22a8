"""Recorded bags: recording, reading, replay at any speed, the same log every time, others' bags.

--only PART   this part alone; may be repeated
--runs N      lockstep runs (100, as the requirement has it: 8 minutes and more)
--seconds S   of 640x480 RGB-D at 30 Hz (20)
--damaged N   bags damaged at random (2000)
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from importlib import import_module

import report
from bags_parts import Effort, Measured
from likeme_core.progress_bar import counted

#: Where each part is measured; looked up when it is its turn, since some need ROS and some none.
PARTS: Mapping[str, str] = {
    'record': 'recording.measure',
    'read': 'reading.measure',
    'lockstep': 'lockstep.measure',
    'size': 'shipped.measure',
    'rosbag2': 'foreign.foreign_bags',
    'damaged': 'foreign.damaged_bags',
}


def part(name: str) -> Callable[[Effort], Measured]:
    """The function that measures a part."""
    module, _, function = PARTS[name].partition('.')
    measure: Callable[[Effort], Measured] = getattr(
        import_module(f'bags_parts.{module}'), function
    )
    return measure


def at_least_one(text: str) -> int:
    """A whole number from 1 on."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f'expected a whole number from 1 on, got {text!r}')
    return int(text)


def main() -> None:
    """Measure the chosen parts and print them."""
    parser = report.option_parser('bags', usage=__doc__)
    parser.add_argument('--only', action='append', choices=PARTS)
    parser.add_argument('--runs', type=at_least_one, default=100)
    parser.add_argument('--seconds', type=at_least_one, default=20)
    parser.add_argument('--damaged', type=at_least_one, default=2000)
    given = parser.parse_args()
    effort = Effort(given.runs, given.seconds, given.damaged)
    bars: list[report.Bar] = []
    notes: dict[str, object] = {}
    chosen = [name for name in PARTS if given.only is None or name in given.only]
    for name in counted(chosen, 'parts', len(chosen)):
        more, said = part(name)(effort)
        bars += more
        notes |= said
    sys.exit(not report.publish('bags', bars, notes))


if __name__ == '__main__':
    main()
