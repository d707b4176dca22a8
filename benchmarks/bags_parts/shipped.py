"""What the shipped recordings weigh."""

from __future__ import annotations

from pathlib import Path

from bags_parts import Effort, Measured
from likeme_bags.reading import open_bag
from report import Bar

BAGS = Path(__file__).resolve().parents[2] / 'bags'


def measure(_: Effort) -> Measured:
    """Bytes on disk, and how they compare with those of the messages."""
    paths = sorted(path.parent for path in BAGS.glob('*/metadata.yaml'))
    raw = 0
    for path in paths:
        with open_bag(path) as bag:
            raw += sum(len(record.data) for record in bag.records())
    disk = sum(p.stat().st_size for p in BAGS.rglob('*') if p.is_file())
    return [
        Bar('shipped bags', disk / 1e6, 60, 'MB', 'requirement', len(paths)),
        Bar('shipped bags to raw', disk / raw, None, ''),
    ], {}
