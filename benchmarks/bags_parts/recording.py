"""Recording 640x480 RGB-D at 30 Hz with the command a user has: frames lost, and the effort."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from itertools import cycle
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import psutil
import rclpy
from domain_coordinator import domain_id
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, Image

from bags_parts import Effort, Measured
from bags_parts.camera import HZ, noisy_frames, numbered
from likeme_bags.camera_topics import COLOUR, DEPTH, INFO
from likeme_bags.headers import header_stamp
from likeme_bags.reading import open_bag
from report import Bar


class Recorded(NamedTuple):
    """A recording of `sent` frames: those found in it, the recorder's share of a core, bytes."""

    sent: int
    found: int
    cores: float
    size: int
    raw: int


def measure(effort: Effort) -> Measured:
    """Frames lost, the recorder's share of a core, and the size of what it wrote."""
    with TemporaryDirectory(prefix='likeme-bench-') as folder:
        got = record(Path(folder) / 'bag', effort.seconds)
    lost, n = got.sent - got.found, got.sent
    return [
        Bar('frames lost, 640x480 RGB-D at 30 Hz', lost, 0, 'frames', 'requirement', n),
        Bar('recorder', got.cores, None, 'cores', n=n),
        Bar('recorded', got.raw / 1e6 / effort.seconds, None, 'MB/s of messages', n=n),
        Bar('size of that, fresh noise, to raw', got.size / got.raw, None, '', n=n),
    ], {}


def record(path: Path, seconds: float) -> Recorded:
    """Record what `publish` publishes."""
    with domain_id() as domain:
        env = os.environ | {'ROS_DOMAIN_ID': str(domain)}
        command = [sys.executable, '-m', 'likeme_replay.record', str(path)]
        recorder = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL)
        context = multiprocessing.get_context('spawn')
        told: multiprocessing.Queue[int] = context.Queue()
        camera = context.Process(target=publish, args=(seconds, domain, told), daemon=True)
        camera.start()
        try:
            sent = told.get(timeout=seconds + 180)
            used = psutil.Process(recorder.pid).cpu_times()
            camera.join()
        finally:
            recorder.send_signal(signal.SIGINT)
            recorder.wait(120)
    found, raw = _found(path)
    size = sum(file.stat().st_size for file in path.iterdir())
    return Recorded(sent, found, (used.user + used.system) / seconds, size, raw)


def _found(path: Path) -> tuple[int, int]:
    """Frames with both images, and bytes of all messages."""
    seen: dict[str, set[int]] = {COLOUR: set(), DEPTH: set()}
    raw = 0
    with open_bag(path) as bag:
        for got in bag.records():
            raw += len(got.data)
            if got.topic.lstrip('/') in seen:
                seen[got.topic.lstrip('/')].add(header_stamp(got.data))
    return len(seen[COLOUR] & seen[DEPTH]), raw


def publish(seconds: float, domain: int, told: multiprocessing.Queue[int]) -> None:
    """Publish RGB-D at 30 Hz once somebody listens; tell how many frames it were."""
    rclpy.init(domain_id=domain)
    node, images = Node('camera'), QoSProfile(depth=5)
    pubs = {
        INFO: node.create_publisher(CameraInfo, INFO, images),
        COLOUR: node.create_publisher(Image, COLOUR, images),
        DEPTH: node.create_publisher(Image, DEPTH, images),
    }
    made = noisy_frames()
    while not all(pub.get_subscription_count() for pub in pubs.values()):
        rclpy.spin_once(node, timeout_sec=0.1)
    time.sleep(1.0)
    begin, sent = time.monotonic(), 0
    for records in cycle(made):
        if sent >= seconds * HZ:
            break
        time.sleep(max(0.0, begin + sent / HZ - time.monotonic()))
        sent += 1
        for one in records:
            pubs[one.topic].publish(numbered(one, sent).data)
    told.put(sent)
    for pub in pubs.values():
        pub.wait_for_all_acked()
    rclpy.try_shutdown()
