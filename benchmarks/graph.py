"""The running graph: camera rate, camera-to-table_state latency, frames lost, CPU per node.

Starts the cell by scripts/start_cell.sh on a ROS domain of its own. Latency is measured from the
arrival of camera_info, which is published just before the images of the same stamp, to the arrival
of the table_state of this stamp: two image transports, perception, and the transport back.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import rclpy
from domain_coordinator import domain_id
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo

from likeme_core.progress_bar import counted
from likeme_core.ros.time import stamp_ns
from likeme_core.standby import IMPORTING, WAITING
from likeme_msgs.msg import TableState
from likeme_msgs.srv import ExecuteAction
from report import Bar, option_parser, publish

ROOT = Path(__file__).resolve().parents[1]
NODES = ('arm_driver_node', 'perception_node', 'inference_node')
CAMERA_RATE = 30.0
# A timer of 1/30 s that is never early loses this much over ten seconds.
TIMED = 0.99


@dataclass(frozen=True)
class Phase:
    """Measurements of one phase."""

    name: str
    rate: float
    frames: int
    lost: int
    latency_ms: np.ndarray
    cpu: dict[str, float]


class Listener(Node):
    """Arrival times by stamp of camera_info and table_state."""

    def __init__(self) -> None:
        super().__init__('graph_benchmark')
        self.camera: dict[int, float] = {}
        self.tables: dict[int, float] = {}
        self.create_subscription(
            CameraInfo,
            'camera/rgb/camera_info',
            self._on_camera,
            qos_profile_sensor_data,
        )
        self.create_subscription(
            TableState,
            'table_state',
            self._on_table,
            10,
        )
        self.human = self.create_client(ExecuteAction, 'human/execute_action')
        self.arm = self.create_client(ExecuteAction, 'arm/execute_action')

    def _on_camera(self, message: CameraInfo) -> None:
        self.camera.setdefault(stamp_ns(message.header.stamp), time.monotonic())

    def _on_table(self, message: TableState) -> None:
        self.tables.setdefault(stamp_ns(message.header.stamp), time.monotonic())

    def until(self, done: Callable[[], bool], timeout: float, what: str) -> None:
        """Spin until done; exit with an error message after `timeout` s."""
        deadline = time.monotonic() + timeout
        while not done():
            if time.monotonic() > deadline:
                raise SystemExit(f'Expected {what} within {timeout:.0f} s, got nothing.')
            rclpy.spin_once(self, timeout_sec=0.05)


def _processes(pid: int) -> dict[str, psutil.Process]:
    children = psutil.Process(pid).children(recursive=True)
    return {
        name: child
        for name in NODES
        for child in children
        if name in ' '.join(child.cmdline()) and child.name() not in (IMPORTING, WAITING)
    }


def _measure(
    listener: Listener, name: str, nodes: dict[str, psutil.Process], done: Callable[[], bool]
) -> Phase:
    listener.camera.clear()
    before = {node: sum(process.cpu_times()[:2]) for node, process in nodes.items()}
    start = time.monotonic()
    listener.until(done, 120.0, f'the end of the phase "{name}"')
    seconds = time.monotonic() - start
    cpu = {
        node: (sum(process.cpu_times()[:2]) - before[node]) / seconds
        for node, process in nodes.items()
    }
    camera = dict(listener.camera)
    # The last frames may still be in transit.
    settled = time.monotonic() + 1.0
    listener.until(lambda: time.monotonic() > settled, 5.0, 'the last frames')
    stamps = sorted(camera)
    latency = [(listener.tables[s] - camera[s]) * 1e3 for s in stamps if s in listener.tables]
    arrivals = sorted(camera.values())
    rate = (len(arrivals) - 1) / (arrivals[-1] - arrivals[0])
    return Phase(name, rate, len(stamps), len(stamps) - len(latency), np.array(latency), cpu)


def _after(seconds: float) -> Callable[[], bool]:
    end = time.monotonic() + seconds
    return lambda: time.monotonic() > end


def _acting(client: Any, name: str, action: str) -> Callable[[], bool]:
    future = client.call_async(ExecuteAction.Request(object=name, action=action))

    def done() -> bool:
        if future.done() and not future.result().success:
            raise SystemExit(f'Expected the motion to complete, got: {future.result().message}')
        return bool(future.done())

    return done


def _phases(pid: int) -> list[Phase]:
    listener = Listener()
    try:
        for client in (listener.human, listener.arm):
            listener.until(client.service_is_ready, 60.0, client.srv_name)
        listener.until(lambda: bool(listener.tables), 60.0, 'a first table_state')
        nodes = _processes(pid)
        phases: list[tuple[str, Callable[[], Callable[[], bool]]]] = [
            ('nothing moves', lambda: _after(10.0)),
            ('the hand moves', lambda: _acting(listener.human, 'chicken', 'place_right')),
            ('the arm moves', lambda: _acting(listener.arm, 'lemon', 'push_right')),
        ]
        return [
            _measure(listener, name, nodes, begin())
            for name, begin in counted(phases, 'phases', len(phases), timed=True)
        ]
    finally:
        listener.destroy_node()  # type: ignore[no-untyped-call]


def main() -> None:
    """Run the three phases and publish."""
    option_parser('graph').parse_args()
    with domain_id() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        cell = subprocess.Popen(
            [str(ROOT / 'scripts' / 'start_cell.sh'), '--seed', '1'],
            stdout=subprocess.DEVNULL,
            stderr=sys.stderr,
        )
        rclpy.init()
        try:
            phases = _phases(cell.pid)
        finally:
            rclpy.try_shutdown()
            cell.send_signal(signal.SIGINT)
            cell.wait(30)
    bars = []
    for phase, wanted in zip(
        phases, (TIMED * CAMERA_RATE, TIMED * CAMERA_RATE, 15.0), strict=True
    ):
        p50, p99 = np.percentile(phase.latency_ms, [50, 99])
        n = phase.frames
        bars += [
            Bar(f'camera rate, {phase.name}', phase.rate, wanted, 'Hz', 'the Kinect', n, False),
            Bar(f'latency p50, {phase.name}', float(p50), None, 'ms', None, n),
            Bar(f'latency p99, {phase.name}', float(p99), None, 'ms', None, n),
            Bar(f'frames lost, {phase.name}', phase.lost, 0, 'frames', 'none lost', n),
        ]
        bars += [
            Bar(f'CPU of {node}, {phase.name}', share, None, 'cores', None, n)
            for node, share in phase.cpu.items()
        ]
    publish('graph', bars, {})


if __name__ == '__main__':
    main()
