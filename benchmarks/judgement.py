"""New objects, promises, asking by cost, joint goals, also in the cell: the parts of `--part`.

Each module of judgement_parts has `bars(options)`, which gives the report's bars. `--part NAME`
(repeatable) runs some of them, `--seeds N` and `--worlds N` change the sample sizes that the bars
were set for. The seeds and the generators of robots, people and worlds are in the modules.
"""

from __future__ import annotations

import importlib
import time
from pathlib import Path

from report import Bar, option_parser, publish, whole_number

PARTS = tuple(sorted(path.stem for path in Path(__file__).parent.glob('judgement_parts/*.py')))


def main() -> None:
    """Measure and publish."""
    parser = option_parser('judgement')
    parser.add_argument('--part', action='append', choices=PARTS, help='all, if not given')
    parser.add_argument('--seeds', type=whole_number, help='runs of each object; 100')
    parser.add_argument('--worlds', type=whole_number, help='bootstrapped worlds; 1000')
    options = parser.parse_args()
    bars: list[Bar] = []
    notes = {}
    for part in options.part or PARTS:
        begin = time.monotonic()
        bars += importlib.import_module(f'judgement_parts.{part}').bars(options)
        notes[part] = f'{time.monotonic() - begin:.0f} s'
    publish('judgement', bars, notes)


if __name__ == '__main__':
    main()
