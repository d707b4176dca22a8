"""Recorded bags: what is read of bags that others wrote, damaged bags, and how fast.

The bags of others are looked for in `LIKEME_SHARED`, or `../shared` beside the project; without
them those bars are left out. Rates are in processor time of one thread.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rosbags.rosbag2 import Reader

import report
from likeme_bags.errors import LIBRARY_ERRORS, BagError
from likeme_bags.images import IMAGE, DecodedImage, decode_image, image_record
from likeme_bags.reading import open_bag
from likeme_bags.samples import BEGIN, PERIOD
from likeme_bags.values import Topic
from likeme_bags.writing import BagWriter

SHARED = Path(os.environ.get('LIKEME_SHARED', Path(__file__).resolve().parents[2] / 'shared'))
FOREIGN = SHARED / 'data' / 'bags' / 'rosbag2'
FUZZ_RUNS, FRAMES = 2000, 90
Bars = list[report.Bar]
Notes = dict[str, object]


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


def foreign_bags() -> tuple[Bars, Notes]:
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
    bars = [
        report.Bar(
            'rosbag2 folders read in full',
            len(read),
            # wrong_rmw_test, twice: serialised in another way, which no reader can use.
            len(folders) - 2,
            'folders',
            'all but two that say they are not CDR',
            len(folders),
            at_most=False,
        ),
        report.Bar('messages in them', sum(read), None, 'messages', n=len(read)),
        report.Bar(
            'folders that lose messages in silence',
            len(ours_silent),
            0,
            'folders',
            'the counts in metadata.yaml',
            len(folders),
        ),
        report.Bar(
            'the same, by the rosbags library', len(silent), None, 'folders', n=len(folders)
        ),
    ]
    return bars, {'refused': [f.parent.name + '/' + f.name for f, c in ours.items() if c is None]}


def damaged_bags() -> tuple[Bars, Notes]:
    """The fuzz test, in a process with bounded memory."""
    command = [sys.executable, '-m', 'likeme_bags.fuzz', '--runs', str(FUZZ_RUNS), '--seed', '1']
    begin = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - begin
    said = done.stdout.splitlines()[-1] if done.stdout else done.stderr
    broken = int(said.rpartition(': ')[2].split()[0])
    return [
        report.Bar('damaged bags: broken promises', broken, 0, 'bags', n=FUZZ_RUNS),
        report.Bar('damaged bags read', FUZZ_RUNS / seconds, None, '1/s', n=FUZZ_RUNS),
    ], {'fuzz': said}


def _write_camera(folder: Path, compress: str) -> int:
    """Three seconds of 640x480 RGB-D at 30 Hz with a camera's noise; bytes of the messages."""
    rng = np.random.default_rng(2)
    rows, columns = np.indices((480, 640))
    scene = np.stack([columns // 4, rows // 3, (rows + columns) // 8], -1) % 200
    size = 0
    with BagWriter(folder, compress=compress or False) as writer:
        for name in ('/rgb', '/depth'):
            writer.add(Topic(name, IMAGE))
        for k in range(FRAMES):
            stamp = BEGIN + k * PERIOD
            noise = rng.normal(0, 2, (480, 640, 3))
            rgb = np.clip(scene + 20 + noise, 0, 255).astype(np.uint8)
            # Steps of a Kinect's disparity: about 3 mm at a metre.
            depth = np.asarray(900 + rows // 8 + noise[:, :, 0], np.uint16) // 3 * 3
            for name, encoding, pixels in (('/rgb', 'rgb8', rgb), ('/depth', '16UC1', depth)):
                record = image_record(name, stamp, DecodedImage(stamp, 'c', encoding, pixels))
                size += len(record.data)
                writer.write(record)
    return size


def reading_rate() -> tuple[Bars, Notes]:
    """How fast a camera's bag is opened and read, beside the rosbags library on the same file."""
    bars: Bars = []
    notes: Notes = {}
    real_time = FRAMES / 30
    with TemporaryDirectory() as name:
        for method in ('zstd', 'lz4', ''):
            kind = method or 'uncompressed'
            folder = Path(name) / kind
            raw = _write_camera(folder, method)
            stored = sum(p.stat().st_size for p in folder.iterdir())
            notes[f'{kind}, stored of raw'] = f'{stored / raw:.2f}'
            for who, read in (('', _read_ours), (', by rosbags', _read_theirs)):
                rate = real_time / min(_seconds(read, folder) for _ in range(3))
                bar = 20.0 if not who else None
                title = f'reading 640x480 RGB-D, {kind}{who}'
                peer = 'offline replay at 20 times real time' if not who else None
                bars.append(
                    report.Bar(title, rate, bar, 'x real time', peer, FRAMES, at_most=False)
                )
            decoding = real_time / min(_seconds(_decode_ours, folder) for _ in range(3))
            title = f'reading and decoding, {kind}'
            bars.append(report.Bar(title, decoding, None, 'x real time', n=FRAMES, at_most=False))
    return bars, notes


def _read_ours(folder: Path) -> None:
    with open_bag(folder) as bag:
        assert sum(1 for _ in bag.records()) == 2 * FRAMES


def _decode_ours(folder: Path) -> None:
    with open_bag(folder) as bag:
        for record in bag.records():
            decode_image(record)


def _read_theirs(folder: Path) -> None:
    with Reader(folder) as reader:
        assert sum(1 for _ in reader.messages()) == 2 * FRAMES


def _seconds(read: Callable[[Path], None], folder: Path) -> float:
    begin = time.process_time()
    read(folder)
    return time.process_time() - begin


# What `bench.sh bags` measures, in this order.
PARTS: list[Callable[[], tuple[Bars, Notes]]] = [foreign_bags, damaged_bags, reading_rate]


def main() -> None:
    """Measure all parts and print them."""
    bars: Bars = []
    notes: Notes = {}
    for part in PARTS:
        more, said = part()
        bars += more
        notes |= said
    sys.exit(not report.publish('bags', bars, notes))


if __name__ == '__main__':
    main()
