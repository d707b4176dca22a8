"""Recordings: frames lost while recording, offline speed, the same log every time, size.

--runs N      lockstep runs for the determinism figure (100)
--seconds S   of 640x480 RGB-D at 30 Hz to record (20)
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path
from typing import NamedTuple

import psutil
import rclpy
from domain_coordinator import domain_id
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, Image

import report
from likeme_arm_sim.cell import Cell
from likeme_arm_sim.scene import Scene
from likeme_bags.reading import open_bag
from likeme_bags.values import Record
from likeme_bringup.replaying import camera_messages
from likeme_bringup.replaying.cores import rgbd_frame
from likeme_bringup.replaying.decision_log import Entry
from likeme_bringup.replaying.foreign import adapted
from likeme_bringup.replaying.lockstep_node import LockstepNode
from likeme_bringup.replaying.offline import replay_offline
from likeme_bringup.replaying.own_nodes import own_nodes
from likeme_bringup.replaying.performance import perform
from likeme_bringup.replaying.script import COLOUR, DEPTH, INFO, Frame, Script, header_stamp
from likeme_bringup.replaying.transport import Transport

BAGS = Path(__file__).resolve().parents[1] / 'bags'
PLAYED = 'put_back', 'story_asks', 'pear_right_left_place'
#: Recorded s per s; 0: as fast as it is acknowledged.
RATES = 0.0, 4.0, 10.0, 30.0
FRAMES = 30


class Recorded(NamedTuple):
    """A recording of `sent` frames: those found in it, and the recorder's share of a core."""

    sent: int
    found: int
    cores: float
    size: int
    raw: int


def number_of(option: str, default: int) -> int:
    """The whole number after an option of this benchmark's command line."""
    words = sys.argv[1:]
    return int(words[words.index(option) + 1]) if option in words else default


def frames() -> list[tuple[Record, ...]]:
    """Frames of the cell with fresh noise in each, as a Kinect gives them."""
    cell, made = Cell(Scene(), 1), []
    for _ in range(FRAMES):
        cell.step(1 / 30)
        images, camera = cell.frame(), Scene().camera
        made.append(camera_messages.frame_records(0, images.rgb, images.depth_mm, camera))
    return made


def publish(seconds: float, domain: int, told: multiprocessing.Queue[int]) -> None:
    """Publish RGB-D at 30 Hz once somebody listens; tell how many frames it were."""
    rclpy.init(domain_id=domain)
    node, images = Node('camera'), QoSProfile(depth=5)
    pubs = {
        INFO: node.create_publisher(CameraInfo, INFO, images),
        COLOUR: node.create_publisher(Image, COLOUR, images),
        DEPTH: node.create_publisher(Image, DEPTH, images),
    }
    made = frames()
    while not all(pub.get_subscription_count() for pub in pubs.values()):
        rclpy.spin_once(node, timeout_sec=0.1)
    time.sleep(1.0)
    begin, sent = time.monotonic(), 0
    for records in cycle(made):
        if sent >= seconds * 30:
            break
        time.sleep(max(0.0, begin + sent / 30 - time.monotonic()))
        sent += 1
        for record in records:
            # The frame's number, in place of the stamp's seconds.
            data = record.data[:4] + sent.to_bytes(4, 'little') + record.data[8:]
            pubs[record.topic].publish(data)
    told.put(sent)
    for pub in pubs.values():
        pub.wait_for_all_acked()
    rclpy.try_shutdown()


def record(path: Path, seconds: float) -> Recorded:
    """Record what `publish` publishes, with the command a user has."""
    with domain_id() as domain:
        env = os.environ | {'ROS_DOMAIN_ID': str(domain)}
        command = [sys.executable, '-m', 'likeme_bringup.replaying.record', str(path)]
        recorder = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL)
        context = multiprocessing.get_context('spawn')
        told: multiprocessing.Queue[int] = context.Queue()
        camera = context.Process(target=publish, args=(seconds, domain, told))
        camera.start()
        sent = told.get(timeout=seconds + 180)
        used = psutil.Process(recorder.pid).cpu_times()
        camera.join()
        recorder.send_signal(signal.SIGINT)
        recorder.wait(120)
    with open_bag(path) as bag:
        seen: dict[str, set[int]] = {COLOUR: set(), DEPTH: set()}
        raw = 0
        for got in bag.records():
            raw += len(got.data)
            if got.topic.lstrip('/') in seen:
                seen[got.topic.lstrip('/')].add(header_stamp(got.data))
    found = len(seen[COLOUR] & seen[DEPTH])
    size = sum(file.stat().st_size for file in path.iterdir())
    return Recorded(sent, found, (used.user + used.system) / seconds, size, raw)


class Speed(NamedTuple):
    """Recorded s per s of processor time: reading and decoding alone, and with the cores."""

    decoding: float
    cores: float
    frames: int


def speed(path: Path, rate: float) -> Speed:
    """How fast a bag of `rate` frames per s goes offline."""
    begin = time.process_time()
    with open_bag(path) as bag:
        steps = Script(adapted({}, {})(bag, None, None)).steps()
        count = sum(rgbd_frame(step) is not None for step in steps if isinstance(step, Frame))
    decoding = time.process_time() - begin
    begin = time.process_time()
    replay_offline(path)
    cores = time.process_time() - begin
    return Speed(count / rate / decoding, count / rate / cores, count)


def spin(stop_at: float) -> None:
    """Never rest."""
    while time.monotonic() < stop_at:
        sum(range(10_000))


@contextmanager
def loaded_cores() -> Iterator[None]:
    """One process that never rests for each core."""
    context = multiprocessing.get_context('spawn')
    end = time.monotonic() + 7200
    spinning = [context.Process(target=spin, args=(end,), daemon=True) for _ in _cores()]
    for process in spinning:
        process.start()
    try:
        yield
    finally:
        for process in spinning:
            process.kill()
            process.join()


def _cores() -> set[int]:
    return os.sched_getaffinity(0)


def lockstep_hashes(runs: int) -> dict[str, set[str]]:
    """Hashes of the logs of lockstep runs with all cores busy, by bag; the shipped log's with."""
    hashes = {name: {_hash((BAGS / f'{name}.jsonl').read_bytes())} for name in PLAYED}
    with domain_id() as domain, own_nodes(domain, {}), loaded_cores():
        rclpy.init(domain_id=domain)
        for run, (name, rate) in enumerate(zip(cycle(PLAYED), cycle(RATES), strict=False), 1):
            if run > runs:
                break
            hashes[name].add(_hash(lockstep_log(BAGS / name, rate).encode()))
            if sys.stderr.isatty():
                print(f'\rlockstep run {run} of {runs}', end='', file=sys.stderr)
        rclpy.try_shutdown()
    return hashes


def lockstep_log(path: Path, rate: float) -> str:
    """The log of one lockstep run with the nodes that run."""
    entries: list[Entry] = []
    node = LockstepNode(Transport(rate))
    try:
        node.begin()
        with open_bag(path) as bag:
            script = Script(adapted({}, {})(bag, None, None))
            perform(script.steps(), script.live, node, entries.append)
    finally:
        node.close()
    return ''.join(f'{entry.line}\n' for entry in entries)


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def shipped_size() -> tuple[int, int]:
    """Bytes of the shipped bags on disk, and of the messages in them."""
    raw = 0
    for path in BAGS.glob('*/metadata.yaml'):
        with open_bag(path.parent) as bag:
            raw += sum(len(record.data) for record in bag.records())
    return sum(p.stat().st_size for p in BAGS.rglob('*') if p.is_file()), raw


def main() -> None:
    """Measure and print."""
    runs, seconds = number_of('--runs', 100), number_of('--seconds', 20)
    with tempfile.TemporaryDirectory(prefix='likeme-bench-') as folder:
        recorded = record(Path(folder) / 'bag', seconds)
        noisy = speed(Path(folder) / 'bag', 30.0)
    small = speed(BAGS / 'put_back', 12.0)
    disk, raw = shipped_size()
    hashes = lockstep_hashes(runs)
    most = max(map(len, hashes.values()))
    Bar, lost = report.Bar, recorded.sent - recorded.found  # noqa: N806
    real = 'x real time (processor time)'
    report.publish(
        'bags_play',
        [
            Bar('frames lost, 640x480 RGB-D at 30 Hz', lost, 0, '', 'requirement', recorded.sent),
            Bar('recorder', recorded.cores, None, 'cores', None, recorded.sent),
            Bar('size of that, fresh noise, to raw', recorded.size / recorded.raw, None, ''),
            Bar('offline, 30 Hz, decoding', noisy.decoding, 20, real, 'aim', noisy.frames, False),
            Bar('offline, 30 Hz, cores', noisy.cores, None, real, None, noisy.frames, False),
            Bar('offline, shipped 12 Hz, decoding', small.decoding, 20, real, 'aim', small.frames,
                False),
            Bar('offline, shipped 12 Hz, cores', small.cores, None, real, None, small.frames,
                False),
            Bar('distinct logs of a bag, lockstep, cores busy', most, 1, '', 'requirement', runs),
            Bar('shipped bags', disk / 1e6, 60, 'MB', 'requirement', len(list(BAGS.glob('*/')))),
            Bar('shipped bags to raw', disk / raw, None, ''),
        ],
        {'rates of the lockstep runs': RATES, 'bags played': PLAYED},
    )  # fmt: skip


if __name__ == '__main__':
    main()
