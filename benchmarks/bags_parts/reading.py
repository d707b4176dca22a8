"""How fast a camera's bag is read, and its pictures decoded, beside the rosbags library."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import cycle
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from bags_parts import Effort, Measured
from bags_parts.camera import HZ, noisy_frames, numbered
from likeme_bags.durable import DurableWriter
from likeme_bags.reading import open_bag
from likeme_bags.values import Record
from likeme_perception.frame_reader import decode_frame
from likeme_replay.message_definitions import definitions
from likeme_replay.offline_replay import replay_offline
from likeme_replay.record import Compression
from likeme_replay.recorded_inputs import RecordedFrame, RecordedInputs
from likeme_replay.source_adapters import adapted_source
from report import Bar

#: Frames between two flushes of the recorder.
FLUSH = 15
REPEATS = 5
BAGS = Path(__file__).resolve().parents[2] / 'bags'
SHIPPED, SHIPPED_HZ = 'put_back', 12.0
REAL = 'x real time'
AIM = 'offline replay at 20 times real time'


class Took(NamedTuple):
    """The least of some tries: s by the clock, and s of processor time of all threads."""

    clock: float
    processor: float


def measure(effort: Effort) -> Measured:
    """Reading and decoding of noisy 640x480 RGB-D at 30 Hz, packed in each way."""
    bars: list[Bar] = []
    notes: dict[str, object] = {}
    frames = noisy_frames()
    with TemporaryDirectory(prefix='likeme-bench-') as name:
        for compression in Compression:
            path = Path(name) / compression
            count, raw = write(path, frames, effort.seconds, compression)
            size = sum(p.stat().st_size for p in path.iterdir())
            notes[f'{compression}: stored of raw'] = f'{size / raw:.2f}'
            bars += _rates(path, compression, count)
            if compression is Compression.LZ4:
                bars += through_the_cores(path, '30 Hz, lz4', count, HZ)
    shipped = BAGS / SHIPPED
    count = decode(shipped)
    took = best(decode, shipped)
    title = 'decoding, a shipped bag at 12 Hz'
    bars.append(Bar(title, count / SHIPPED_HZ / took.clock, 20, REAL, AIM, count, at_most=False))
    bars += through_the_cores(shipped, 'a shipped bag at 12 Hz', count, SHIPPED_HZ)
    return bars, notes


def _rates(path: Path, kind: str, count: int) -> list[Bar]:
    decoded, theirs = best(decode, path), best(read_theirs, path)
    lasts = count / HZ
    return [
        Bar(f'decoding, 30 Hz, {kind}', lasts / decoded.clock, 20, REAL, AIM, count, False),
        Bar(f'the same, {kind}, processor time', lasts / decoded.processor, None, REAL, n=count),
        Bar(f'reading alone, {kind}, by rosbags', lasts / theirs.clock, None, REAL, n=count),
    ]


def through_the_cores(path: Path, kind: str, count: int, hz: float) -> list[Bar]:
    """Perception and inference in the loop, which are the limit then."""
    took = best(replay_offline, path, 1)
    return [
        Bar(f'offline replay with the cores, {kind}', count / hz / took.clock, None, REAL, n=count)
    ]


def write(
    path: Path, frames: list[tuple[Record, ...]], seconds: float, compression: str
) -> tuple[int, int]:
    """A recording of so many s as the recorder leaves it; its frames and bytes of messages."""
    writer = DurableWriter(path, compression=compression)
    writer.open()
    known: dict[str, Connection] = {}
    count, raw = round(seconds * HZ), 0
    for number, records in zip(range(1, count + 1), cycle(frames), strict=False):
        for record in (numbered(one, number) for one in records):
            if record.topic not in known:
                text, digest = definitions().of(record.type)
                known[record.topic] = writer.add_connection(
                    record.topic, record.type, msgdef=text, rihs01=digest
                )
            writer.write(known[record.topic], record.stamp, record.data)
            raw += len(record.data)
        if number % FLUSH == 0:
            writer.flush()
    writer.close()
    return count, raw


def decode(path: Path) -> int:
    """All that a replay does before perception: read, pair, and decode the frames."""
    read = definitions().read
    with open_bag(path) as bag:
        steps = RecordedInputs(adapted_source({}, {})(bag, None, None)).steps()
        return sum(
            decode_frame(*(read(r.data, r.type) for r in (step.colour, step.depth))) is not None
            for step in steps
            if isinstance(step, RecordedFrame)
        )


def read_theirs(path: Path) -> None:
    """Every message by the rosbags library, undecoded."""
    with Reader(path) as reader:
        for _ in reader.messages():
            pass


def best(read: Callable[[Path], object], path: Path, repeats: int = REPEATS) -> Took:
    """The shortest of several tries."""
    tries = []
    for _ in range(repeats):
        clock, processor = time.perf_counter(), time.process_time()
        read(path)
        tries.append((time.perf_counter() - clock, time.process_time() - processor))
    return Took(min(t[0] for t in tries), min(t[1] for t in tries))
