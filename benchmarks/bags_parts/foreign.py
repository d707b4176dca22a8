"""Bags that others wrote, and damaged ones: what is read, and what is lost in silence.

The bags of others are looked for in `LIKEME_SHARED`, or `../shared` beside the project; without
them those bars are left out.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

from rosbags.rosbag2 import Reader

from bags_parts import Effort, Measured
from likeme_bags.errors import LIBRARY_ERRORS, BagError
from likeme_bags.reading import open_bag
from report import Bar

SHARED = Path(os.environ.get('LIKEME_SHARED', Path(__file__).resolve().parents[3] / 'shared'))
FOREIGN = SHARED / 'data' / 'bags' / 'rosbag2'
FUZZ = Path(__file__).resolve().parents[2] / 'ros2_ws/src/likeme_bags/test/fuzz_bags.py'
#: wrong_rmw_test, twice: serialised in another way, which no reader can use.
NOT_CDR = 2


def foreign_bags(_: Effort) -> Measured:
    """Folders that rosbag2 itself wrote: all read, or refused with the reason."""
    files = [p for end in ('mcap', 'db3') for p in FOREIGN.rglob(f'*.{end}')]
    folders = sorted({p.parent for p in files if p.parent.name != 'bags'})
    if not folders:
        return [], {'bags of others': f'none in {FOREIGN}'}
    ours = {folder: _read_by_us(folder) for folder in folders}
    read = [count for count in ours.values() if count is not None]
    theirs = {folder: _read_by_rosbags(folder) for folder in folders}
    silent = [folder for folder, (said, passed) in theirs.items() if passed < said]
    # A bag that is refused (None) is not silent.
    ours_silent = [f for f, (said, _) in theirs.items() if (ours[f] or said) < said]
    n = len(folders)
    refused = [f'{f.parent.name}/{f.name}' for f, count in ours.items() if count is None]
    return [
        Bar('rosbag2 folders read in full', len(read), n - NOT_CDR, 'folders',
            'all but two that say they are not CDR', n, at_most=False),
        Bar('messages in them', sum(read), None, 'messages', n=len(read)),
        Bar('folders that lose messages in silence', len(ours_silent), 0, 'folders',
            'the counts in metadata.yaml', n),
        Bar('the same, by the rosbags library', len(silent), None, 'folders', n=n),
    ], {'refused': refused}  # fmt: skip


def _read_by_us(folder: Path) -> int | None:
    """Messages passed on; None: the bag was refused, with a sentence."""
    try:
        with open_bag(folder) as bag:
            count = sum(1 for _ in bag.records())
            assert bag.complete, folder
            return count
    except BagError:
        return None


def _read_by_rosbags(folder: Path) -> tuple[int, int]:
    """Messages the library says there are, and those it passes on; (0, 0) when it raises."""
    try:
        with Reader(folder) as reader:
            return reader.message_count, sum(1 for _ in reader.messages())
    except (*LIBRARY_ERRORS, OSError):
        return 0, 0


def damaged_bags(effort: Effort) -> Measured:
    """The fuzz test, in a process with bounded memory."""
    runs = effort.damaged
    command = [sys.executable, str(FUZZ), '--runs', str(runs), '--seed', '1']
    begin = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - begin
    said = done.stdout.splitlines()[-1] if done.stdout else done.stderr
    broken = int(said.rpartition(': ')[2].split()[0])
    return [
        Bar('damaged bags: broken promises', broken, 0, 'bags', n=runs),
        Bar('damaged bags read', runs / seconds, None, '1/s', n=runs),
    ], {'fuzz': said}
