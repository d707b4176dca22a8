"""Report of a benchmark as JSON or as a table: the machine and the measured figures.

A benchmark is a script `benchmarks/NAME.py` with a `main()` that takes its options from
`report.option_parser('name')` and ends in `report.publish('name', [Bar(...), ...], notes={...})`.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple, NoReturn


class Bar(NamedTuple):
    """One measured figure and its bar."""

    name: str
    measured: float
    # None: reported without a bar.
    bar: float | None
    unit: str
    # Where the bar comes from: a paper, another project, a requirement.
    peer: str | None = None
    # Number of samples.
    n: int = 1
    # True: smaller is better (times, losses); False: larger is better (rates, shares).
    at_most: bool = True

    @property
    def met(self) -> bool | None:
        """Whether the figure reaches its bar (NaN does not); None without a bar."""
        if self.bar is None:
            return None
        return self.measured <= self.bar if self.at_most else self.measured >= self.bar


class _OneLineParser(argparse.ArgumentParser):
    """Says what is wrong with the arguments in one line."""

    def error(self, message: str) -> NoReturn:
        """See argparse."""
        self.exit(2, f'{self.prog}: {" ".join(message.split())}.\n')


def option_parser(name: str, **options: Any) -> argparse.ArgumentParser:
    """The command line of a benchmark; it has --json."""
    made = _OneLineParser(prog=f'bench.sh {name}', **options)
    made.add_argument('--json', action='store_true', help='one JSON document')
    return made


def whole_number(text: str) -> int:
    """An option's value, a whole number from 0 on.

    Raises:
        argparse.ArgumentTypeError: it is none.
    """
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f'expected a whole number from 0 on, got {text!r}')
    return int(text)


def machine() -> dict[str, Any]:
    """Processor, cores, memory (GiB), system, Python."""
    return {
        'processor': _first_field('/proc/cpuinfo', 'model name') or platform.processor(),
        'cores': len(os.sched_getaffinity(0)),
        'memory_gib': round(os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2**30, 1),
        'system': _first_field('/etc/os-release', 'PRETTY_NAME', '=') or platform.system(),
        'kernel': platform.release().split('-')[0],
        'python': platform.python_version(),
        'load_at_end': round(os.getloadavg()[0], 2),
    }


def document(name: str, bars: Sequence[Bar], notes: Mapping[str, Any]) -> dict[str, Any]:
    """The whole report as one JSON-ready value."""
    return {
        'benchmark': name,
        'measured_at': datetime.now(UTC).isoformat(timespec='seconds'),
        'machine': machine(),
        'bars': [bar._asdict() | {'met': bar.met} for bar in bars],
        'notes': dict(notes),
    }


def publish(name: str, bars: Sequence[Bar], notes: Mapping[str, Any] | None = None) -> bool:
    """Print JSON when argv has `--json`, else a table; return whether all bars are met."""
    report = document(name, bars, notes or {})
    if '--json' in sys.argv[1:]:
        print(json.dumps(report, indent=2, default=_plain))
    else:
        print(table(report))
    return all(bar.met is not False for bar in bars)


def table(report: Mapping[str, Any]) -> str:
    """The report as aligned text."""
    rows = [('what', 'measured', 'bar', 'unit', 'n', '', 'bar from')]
    for bar in report['bars']:
        sign = '<=' if bar['at_most'] else '>='
        limit = '' if bar['bar'] is None else f'{sign} {bar["bar"]:.4g}'
        verdict = {True: 'met', False: 'MISSED', None: ''}[bar['met']]
        figures = f'{bar["measured"]:.4g}', limit, bar['unit'], str(bar['n'])
        rows.append((bar['name'], *figures, verdict, bar['peer'] or ''))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ['  '.join(map(str.ljust, row, widths)).rstrip() for row in rows]
    host = report['machine']
    about = (
        f'{host["processor"]}, {host["cores"]} cores, {host["memory_gib"]} GiB, {host["system"]}'
    )
    notes = [f'{key}: {value}' for key, value in report['notes'].items()]
    return '\n'.join([f'{report["benchmark"]} ({about}, Python {host["python"]})', *lines, *notes])


def _first_field(path: str, key: str, separator: str = ':') -> str:
    """Value of the first `key separator value` line of a file, or nothing."""
    try:
        lines = Path(path).read_text(encoding='utf-8').splitlines()
    except OSError:
        return ''
    values = (line.partition(separator)[2] for line in lines if line.startswith(key))
    return next(values, '').strip().strip('"')


def _plain(value: Any) -> Any:
    """NumPy scalars and arrays as JSON values."""
    return value.tolist() if hasattr(value, 'tolist') else str(value)
