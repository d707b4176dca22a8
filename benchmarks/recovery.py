"""Nodes that are killed: time until it is known, and until they are back in service.

    ./scripts/bench.sh recovery [--n N] [--cold] [--json]

Starts the cell under its supervisor on a ROS domain of its own and kills its nodes by SIGKILL,
one after another, N times each (default 20), first with nothing else to do, then with a process on
each core that never rests. Detection: until this process counts the node as silent, or hears its
next run. Recovery: until the node's next run says READY and does its work: a hold_state, a
table_state, an answer of ask_human, an answer of arm/execute_action. --cold: without standby
processes.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import psutil
import rclpy
from domain_coordinator import domain_id
from rclpy.node import Node

from likeme_bringup.respawn import Respawn
from likeme_bringup.start_cell import StartOptions, children
from likeme_bringup.supervisor import Supervisor
from likeme_core.heartbeats import NodeState
from likeme_core.progress_bar import counted
from likeme_core.ros.heartbeat import HeartbeatSubscriber
from likeme_core.standby import IMPORTING, WAITING
from likeme_msgs.msg import HoldState, TableState
from likeme_msgs.srv import AskHuman, ExecuteAction
from report import Bar, option_parser, publish, whole_number

sys.path.append(str(Path(__file__).resolve().parents[1] / 'tools'))
from busy_cores import busy_cores

DETECTION_BAR, RECOVERY_BAR = 0.3, 3.0
#: s in which a node must be back, or the benchmark gives up; between two requests of a service.
PATIENCE, REQUEST_PERIOD = 120.0, 0.05
#: More deaths than any run of this benchmark has, without a pause.
POLICY = Respawn(pauses=(0.0,) * 100_000, standby=1.0)
COLD = POLICY._replace(standby=None)


class Victim(NamedTuple):
    """A node to kill: its name, the word of its command line, and what shows that it works."""

    node: str
    module: str
    works: Callable[[Observer], Callable[[], bool]]


class Death(NamedTuple):
    """Times after one SIGKILL, s, and the CPU time that the next run took to be back, s."""

    detection: float
    recovery: float
    cpu: float


@dataclass
class Requests:
    """Requests to a service, of which any answer will do: call it until it says that one came."""

    client: Any
    request: Any
    sent_at: float = -math.inf
    futures: list[Any] = field(default_factory=list)

    def __call__(self) -> bool:
        """Send a request if it is time to; whether one was answered."""
        now = time.monotonic()
        if now - self.sent_at > REQUEST_PERIOD:
            self.sent_at = now
            self.futures.append(self.client.call_async(self.request))
        return any(future.done() for future in self.futures)


class Observer:
    """A node that hears heartbeats and table states and calls services."""

    def __init__(self) -> None:
        self.node = Node('recovery_benchmark', start_parameter_services=False)
        self.heartbeats = HeartbeatSubscriber(self.node).monitor
        self.tables = 0
        self.node.create_subscription(TableState, 'table_state', self._on_table, 1)
        self.holds = 0
        self.node.create_subscription(HoldState, 'cell/hold_state', self._on_hold, 1)
        self._ask = self.node.create_client(AskHuman, 'ask_human')
        self._arm = self.node.create_client(ExecuteAction, 'arm/execute_action')

    def _on_table(self, _: TableState) -> None:
        self.tables += 1

    def _on_hold(self, _: HoldState) -> None:
        self.holds += 1

    def hears_the_hold(self) -> Callable[[], bool]:
        """The keeper tells whether motion is held."""
        before = self.holds
        return lambda: self.holds > before

    def sees_tables(self) -> Callable[[], bool]:
        """A new table state comes."""
        before = self.tables
        return lambda: self.tables > before

    def answers_questions(self) -> Callable[[], bool]:
        """The inference node answers a request."""
        return Requests(self._ask, AskHuman.Request(command=AskHuman.Request.LIST))

    def answers_actions(self) -> Callable[[], bool]:
        """The arm driver answers: it refuses what it does not know."""
        return Requests(self._arm, ExecuteAction.Request(object='nothing', action='nothing'))

    def until(self, condition: Callable[[], Any], what: str) -> float:
        """Spin until a condition holds; the time, s of the monotonic clock."""
        deadline = time.monotonic() + PATIENCE
        while not condition():
            rclpy.spin_once(self.node, timeout_sec=0.002)
            if time.monotonic() > deadline:
                raise SystemExit(f'Expected {what} within {PATIENCE:.0f} s, got nothing.')
        return time.monotonic()

    def ready(self, name: str, after_run: str = '') -> bool:
        """Whether a node that is not of a given run is READY; true of nodes without heartbeats."""
        known = self.heartbeats.nodes.get(name)
        return known is None or (
            known.run != after_run
            and known.state is NodeState.READY
            and self.heartbeats.alive(name, time.monotonic())
        )


VICTIMS = (
    Victim('/hold_keeper', 'hold_keeper_node', Observer.hears_the_hold),
    Victim('/perception_node', 'perception_node', Observer.sees_tables),
    Victim('/inference_node', 'inference_node', Observer.answers_questions),
    Victim('/arm_driver', 'arm_driver_node', Observer.answers_actions),
)


def process_of(cell: int, module: str, waiting: bool) -> psutil.Process | None:
    """The process of a node, or its standby that has imported all."""
    for child in psutil.Process(cell).children():
        try:
            name, words = child.name(), ' '.join(child.cmdline())
        except psutil.NoSuchProcess:
            continue
        if module in words and (name == WAITING if waiting else name not in (IMPORTING, WAITING)):
            return child
    return None


def kill(observer: Observer, cell: int, victim: Victim, cold: bool) -> Death:
    """Kill a node that is in service and wait until it is again."""
    name = victim.node
    observer.until(observer.sees_tables(), 'table states')
    observer.until(victim.works(observer), f'{name} to work')
    observer.until(lambda: observer.ready(name), f'{name} READY')
    if not cold:
        observer.until(lambda: process_of(cell, victim.module, True), f'a standby of {name}')
    waiting = process_of(cell, victim.module, True)
    cpu_before = 0.0 if waiting is None else sum(waiting.cpu_times()[:2])
    process = process_of(cell, victim.module, False)
    assert process is not None
    # A record is replaced at each heartbeat.
    nodes = observer.heartbeats.nodes
    known = nodes.get(name)
    run = '' if known is None else known.run
    observer.until(lambda: observer.ready(name), f'{name} READY')
    process.kill()
    killed = time.monotonic()
    detected = math.nan
    if known is not None:
        detected = observer.until(
            lambda: (
                nodes[name].run != run or not observer.heartbeats.alive(name, time.monotonic())
            ),
            f'the end of {name}',
        )
        observer.until(lambda: nodes[name].run != run, f'the next run of {name}')
    works = victim.works(observer)
    back = observer.until(
        lambda: works() and observer.ready(name, run), f'{name} in service again'
    )
    new = process_of(cell, victim.module, False)
    cpu = math.nan if new is None else sum(new.cpu_times()[:2]) - cpu_before
    return Death(detected - killed, back - killed, cpu)


def run_cell(policy: Respawn, log: str) -> None:
    """The cell under its supervisor, until SIGTERM."""
    with open(log, 'w', encoding='utf-8') as out:
        Supervisor(children(options=StartOptions(seed=1)), out, respawn=policy).run()


@contextmanager
def running_cell(policy: Respawn) -> Iterator[int]:
    """A cell; its process id."""
    with tempfile.TemporaryDirectory(prefix='likeme-recovery-') as folder:
        os.environ['LIKEME_STATE'] = folder
        # As after the first start anywhere else: imports find compiled files.
        os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
        log = os.path.join(folder, 'cell.log')
        cell = multiprocessing.get_context('spawn').Process(target=run_cell, args=(policy, log))
        cell.start()
        assert cell.pid is not None
        try:
            yield cell.pid
        finally:
            os.kill(cell.pid, signal.SIGTERM)
            cell.join(30)


def deaths(observer: Observer, cell: int, n: int, cold: bool) -> dict[str, list[Death]]:
    """Kill every node `n` times, in turn."""
    found: dict[str, list[Death]] = {victim.node: [] for victim in VICTIMS}
    for number in counted(range(n), 'rounds of deaths', n):
        for victim in VICTIMS:
            death = kill(observer, cell, victim, cold)
            found[victim.node].append(death)
            print(f'{number + 1}/{n} {victim.node}: {death}', file=sys.stderr)
    return found


def bars(found: dict[str, list[Death]], load: str, loaded: bool) -> Iterator[Bar]:
    """Detection of all nodes together, recovery and CPU time of each."""
    detections = [d.detection for each in found.values() for d in each]
    heard = np.array([d for d in detections if not math.isnan(d)])
    peer = 'requirement'
    for percent in (50, 99):
        limit = DETECTION_BAR if loaded and percent == 99 else None
        value = float(np.percentile(heard, percent))
        yield Bar(f'detection p{percent}, {load}', value, limit, 's', peer, len(heard))
    for node, each in found.items():
        times = np.array([death.recovery for death in each])
        for percent in (50, 99):
            limit = RECOVERY_BAR if loaded and percent == 99 else None
            value = float(np.percentile(times, percent))
            yield Bar(f'recovery p{percent} of {node}, {load}', value, limit, 's', peer, len(each))
        cpu = float(np.median([death.cpu for death in each]))
        yield Bar(f'CPU to be back p50 of {node}, {load}', cpu, None, 's', None, len(each))


def main() -> None:
    """Run both phases and publish."""
    parser = option_parser('recovery', description=__doc__)
    parser.add_argument(
        '--n', type=whole_number, default=20, help='kills of each node in each phase'
    )
    parser.add_argument('--cold', action='store_true', help='without standby processes')
    options = parser.parse_args()
    results: list[Bar] = []
    with domain_id() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        with running_cell(COLD if options.cold else POLICY) as cell:
            rclpy.init()
            observer = Observer()
            try:
                idle = deaths(observer, cell, options.n, options.cold)
                with busy_cores(3600.0):
                    loaded = deaths(observer, cell, options.n, options.cold)
            finally:
                observer.node.destroy_node()  # type: ignore[no-untyped-call]
                rclpy.try_shutdown()
    results += [*bars(idle, 'idle', False), *bars(loaded, 'all cores busy', True)]
    publish('recovery', results, {'standby processes': not options.cold})


if __name__ == '__main__':
    main()
