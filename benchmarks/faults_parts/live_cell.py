"""A cell of real processes under its supervisor, watched by all policies."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import psutil
import rclpy
from domain_coordinator import domain_id
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from faults_parts.ledger import Ledger
from likeme_bringup.child import Child
from likeme_bringup.respawn import Respawn
from likeme_bringup.start_cell import MODULES, Part, StartOptions, children
from likeme_bringup.supervisor import Supervisor
from likeme_core.heartbeats import HeartbeatMonitor, NodeState
from likeme_core.instance_lock import claim
from likeme_core.ros.heartbeat import HeartbeatSubscriber
from likeme_core.standby import IMPORTING, WAITING
from likeme_core.tabletop import Mode
from likeme_inference.experience.decision_log import LOG_FILE, DecisionLog
from likeme_msgs.msg import Demonstration, TableState
from likeme_msgs.srv import AskHuman, ExecuteAction, ResetCell
from likeme_replay.policies.monitor import PolicyMonitor
from likeme_replay.ros.policy_monitor_node import PolicyMonitorNode
from virtual_hosts.hosts import OWN_NETWORK, Host, hosts_at_switch

NAMES = {
    Part.HOLD: '/hold_keeper', Part.ARM: '/arm_driver', Part.PERCEPTION: '/perception_node',
    Part.INFERENCE: '/inference_node',
}  # fmt: skip
#: More deaths than any campaign has, without a pause.
POLICY = Respawn(pauses=(0.0,) * 100_000, standby=1.0)
#: Only the superuser can give the cell's state a file system of its own.
MAY_MOUNT = os.geteuid() == 0 and shutil.which('mount') is not None
STATE_SIZE = '64m'
#: Hosts of nodes where network namespaces are allowed. Images stay on one.
HOSTS = ((Part.HOLD,), (Part.ARM, Part.PERCEPTION), (Part.INFERENCE,))
MAY_CUT = OWN_NETWORK in os.environ
#: frame_id of messages that a fault injects: they are no message of the cell.
INJECTED = 'injected'


class Watch(PolicyMonitorNode):
    """The policy monitor without injected messages, and with a ledger."""

    def __init__(self) -> None:
        self.ledger = Ledger()
        super().__init__()

    @property
    def monitor(self) -> PolicyMonitor:
        """What it has found."""
        return self._monitor

    def _receive(self, topic: str, message: Any, info: dict[str, Any]) -> None:
        header = getattr(message, 'header', None)
        if topic != 'heard' and header is not None and header.frame_id == INJECTED:
            return
        self.ledger.observe(topic, message)
        super()._receive(topic, message, info)


class LiveCell:
    """The processes, and a node of this one to talk to them.

    Attributes:
        watch: the policies.
        domain: of ROS.
        folder: of the cell's state.
        hosts: of its nodes, where it has several.
        heartbeats: of its nodes.
    """

    def __init__(
        self, supervisor: int, folder: Path, domain: int, hosts: Mapping[Part, Host], context: Any
    ) -> None:
        self._supervisor, self.folder, self.domain = supervisor, folder, domain
        self.hosts = hosts
        self.node = Node('faults', context=context, start_parameter_services=False)
        self.watch = Watch()
        self.heartbeats: HeartbeatMonitor = HeartbeatSubscriber(self.node).monitor
        self.table: TableState | None = None
        self.node.create_subscription(TableState, 'table_state', self._on_table, 1)
        self.tables = self.node.create_publisher(TableState, 'table_state', 10)
        self.demonstrations = self.node.create_publisher(Demonstration, 'demonstration', 10)
        self.clock = self.node.create_publisher(Clock, '/clock', 10)
        self.person = self.node.create_client(ExecuteAction, 'human/execute_action')
        self.reset = self.node.create_client(ResetCell, 'cell/reset')
        self.desk = self.node.create_client(AskHuman, 'ask_human')
        self.hold = self.node.create_client(Trigger, 'cell/hold')
        self.resume = self.node.create_client(Trigger, 'cell/resume')
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self._executor.add_node(self.watch)

    def _on_table(self, message: TableState) -> None:
        if message.header.frame_id != INJECTED:
            self.table = message

    @property
    def ready(self) -> bool:
        """Whether every node is READY."""
        now = time.monotonic()
        nodes = self.heartbeats.nodes
        return all(
            self.heartbeats.alive(name, now) and nodes[name].state is NodeState.READY
            for name in NAMES.values()
        )

    def until(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Spin until a condition holds; whether it did within some s."""
        deadline = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > deadline:
                return False
            self._executor.spin_once(timeout_sec=0.005)
        return True

    def ask(
        self, client: Any, request: Any, seconds: float,
        meanwhile: Callable[[], None] = lambda: None,
    ) -> Any:  # fmt: skip
        """Call a service, again each few s where no answer comes; None: none came in time.

        meanwhile: called again and again while it waits.
        """
        deadline, futures, again = time.monotonic() + seconds, [], 0.0
        while time.monotonic() < deadline:
            if client.service_is_ready() and time.monotonic() >= again:
                futures.append(client.call_async(request))
                again = time.monotonic() + seconds / 3
            self._executor.spin_once(timeout_sec=0.005)
            meanwhile()
            for future in futures:
                if future.done():
                    return future.result()
        return None

    def process(self, part: Part) -> psutil.Process | None:
        """The process of a node, not its standby."""
        return self._child(part, lambda name: name not in (IMPORTING, WAITING))

    def standby(self, part: Part) -> psutil.Process | None:
        """The standby process of a node, once it waits."""
        return self._child(part, lambda name: name == WAITING)

    def _child(self, part: Part, named: Callable[[str], bool]) -> psutil.Process | None:
        for child in psutil.Process(self._supervisor).children():
            try:
                name, words = child.name(), ' '.join(child.cmdline())
            except psutil.NoSuchProcess:
                continue
            if MODULES[part] in words and named(name):
                return child
        return None

    def check_log(self) -> tuple[list[Any], str]:
        """What is lost from the log, and what is wrong with its chain."""
        log = DecisionLog(str(self.folder / LOG_FILE), create=False)
        try:
            return self.watch.ledger.lost(log), log.verify().problem
        finally:
            log.close()

    def close(self) -> None:
        """End this process's nodes."""
        self._executor.shutdown()
        self.watch.destroy_node()
        self.node.destroy_node()


def _supervise(options: StartOptions, domain: int, log: str, hosts: Mapping[Part, Host]) -> None:
    """The cell under its supervisor, until SIGTERM."""
    nodes = children(options=options)
    if hosts:
        nodes = [_on(hosts[Part(each.name)], each) for each in nodes]
    with open(log, 'w', encoding='utf-8') as out, claim(domain, tuple(Part)):
        Supervisor(nodes, out, respawn=POLICY).run()


def _on(host: Host, child: Child) -> Child:
    assert child.standby is not None, 'Every node of a cell has a standby.'
    return child._replace(
        command=host.command(*child.command), standby=host.command(*child.standby)
    )


@contextmanager
def live_cell(seed: int) -> Iterator[LiveCell]:
    """A cell on a ROS domain of its own, ready."""
    options = StartOptions(seed=seed, real_time_factor=2.0, mode=Mode.INTERACTIVE, threshold=0.7)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix='likeme_faults_')))
        state = folder / 'state'
        state.mkdir()
        if MAY_MOUNT:
            size = f'size={STATE_SIZE}'
            subprocess.run(['mount', '-t', 'tmpfs', '-o', size, 'tmpfs', str(state)], check=True)
            stack.callback(subprocess.run, ['umount', '--lazy', str(state)], check=True)
        hosts = {}
        if MAY_CUT:
            # After the mount, for them to see it.
            at_switch = stack.enter_context(hosts_at_switch(len(HOSTS)))
            hosts = {p: host for host, parts in zip(at_switch, HOSTS, strict=True) for p in parts}
            os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SUBNET'
        domain = stack.enter_context(domain_id())
        os.environ |= {'ROS_DOMAIN_ID': str(domain), 'LIKEME_STATE': str(state)}
        context = multiprocessing.get_context('spawn')
        supervisor = context.Process(
            target=_supervise, args=(options, domain, str(folder / 'cell.log'), hosts)
        )
        supervisor.start()
        stack.callback(_end, supervisor)
        rclpy.init(domain_id=domain)
        stack.callback(rclpy.try_shutdown)
        assert supervisor.pid is not None, 'It was started.'
        cell = LiveCell(
            supervisor.pid, state / f'domain_{domain}', domain, hosts, rclpy.get_default_context()
        )
        stack.callback(cell.close)
        if not cell.until(lambda: cell.ready and cell.table is not None, 90.0):
            raise SystemExit(f'Expected a cell, got: {(folder / "cell.log").read_text()[-500:]}')
        yield cell


def _end(supervisor: Any) -> None:
    os.kill(supervisor.pid, signal.SIGTERM)
    supervisor.join(30)
    if supervisor.is_alive():
        supervisor.kill()
