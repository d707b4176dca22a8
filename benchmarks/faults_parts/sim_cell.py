"""A cell in simulated time: the real inference node and hold keeper, simulated arm and camera."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from std_srvs.srv import Trigger

from faults_parts.ledger import Ledger
from faults_parts.sim_arm import Arm
from faults_parts.sim_graph import Graph, Process
from faults_parts.sim_node import SimNode
from faults_parts.sim_operator import Operator
from faults_parts.sim_store import StoreFaults
from faults_parts.sim_table import Table
from faults_parts.sim_time import SIM_TIME
from likeme_arm.hold_keeper_node import HoldKeeperNode
from likeme_arm.motion_journal import JournalError
from likeme_core.paper_world import WORLD
from likeme_inference.experience.decision_log import LOG_FILE, DecisionLog
from likeme_inference.experience.store_error import StoreError
from likeme_inference.inference_node import InferenceNode
from likeme_inference.node_settings import read_model
from likeme_msgs.msg import Decision, Outcome
from likeme_replay.policies.monitor import PolicyMonitor
from likeme_replay.policies.policy import Bounds

INFERENCE, ARM, KEEPER, CAMERA = 'inference_node', 'arm_driver', 'hold_keeper', 'perception_node'
NODES = (INFERENCE, ARM, KEEPER, CAMERA)
#: Faults that last longer than a supervisor needs are part of the campaign.
BOUNDS = Bounds(recovery=30.0, outcome=60.0, arm_wait=80.0)
#: s from an end to the next start, of the supervisor.
RESPAWN = 0.3


class Cell:
    """One cell with its nodes, an operator, all policies and a ledger.

    Attributes:
        processes: by the node's name; killed ones too, until they are started again.
        decision, outcome: the last ones.
        belief: object of the last belief.
    """

    def __init__(
        self, folder: Path, rng: np.random.Generator, stores: StoreFaults, **parameters: Any
    ) -> None:
        """parameters: of the inference node."""
        os.environ['LIKEME_STATE'] = str(folder)
        self._folder, self._rng = folder, rng
        self.world, self.graph, self.stores = WORLD, Graph(), stores
        self.graph.parameters = {INFERENCE: parameters}
        self.monitor, self.ledger = PolicyMonitor(BOUNDS), Ledger()
        self._keeper: HoldKeeperNode | None = None
        self.decision: Decision | None = None
        self.outcome: Outcome | None = None
        self.belief: tuple[str, int] | None = None
        self.graph.observers += [self._observe, self.ledger.observe]
        stores.problem, stores.full = '', False
        stores.on_event, stores.on_written = self.graph.happens, self.ledger.written
        self.table = Table(self.graph, WORLD)
        self._model = read_model('', WORLD)
        self.processes: dict[str, Process] = {CAMERA: self.table.process}
        self._arm: Arm | None = None
        for name in (KEEPER, ARM, INFERENCE):
            self.start(name)
        self.operator = Operator(
            self.graph, WORLD, lambda message: self._hear('questions', message),
            self.ledger.answered,
        )  # fmt: skip
        with self.graph.process('console'):
            console = SimNode('console')
            self._hold = console.create_client(Trigger, 'cell/hold')
            self._resume = console.create_client(Trigger, 'cell/resume')

    def hold(self) -> None:
        """Call cell/hold."""
        self._hold.call_async(Trigger.Request())

    def resume(self) -> None:
        """Call cell/resume, until a keeper that may be restarting just now has done it."""
        self._resume.call_async(Trigger.Request())

        def again() -> None:
            if self.monitor.seen.hold.held:
                self.resume()

        self.graph.after(1.0, again)

    def kill(self, name: str, respawn: float = RESPAWN) -> None:
        """SIGKILL a node; the supervisor starts it again after some s."""
        process = self.processes[name]
        if not process.alive:
            return
        self.graph.after(respawn, lambda: self.start(name))
        if name == ARM and self._arm is not None:
            self._arm.close()
        if name == KEEPER and self._keeper is not None:
            # As the kernel does.
            self._keeper._lock.close()
        process.kill()

    def start(self, name: str) -> None:
        """Start a node; one that does not start is started again, as by the supervisor."""
        try:
            self.processes[name] = self._started(name)
        except (StoreError, JournalError, ValueError, OSError):
            self.graph.after(2 * RESPAWN, lambda: self.start(name))

    @property
    def ready(self) -> bool:
        """Whether every node runs."""
        return all(self.processes[name].alive for name in NODES)

    @property
    def open(self) -> Decision | None:
        """The decision that waits for its outcome."""
        found: Decision | None = self.monitor.seen.open_decision
        return found

    def check_log(self) -> tuple[list[Any], str]:
        """What is lost from the log, and what is wrong with its chain."""
        log = DecisionLog(str(self._folder / 'domain_0' / LOG_FILE), create=False)
        try:
            return self.ledger.lost(log), log.verify().problem
        finally:
            log.close()

    def close(self) -> None:
        """End all nodes."""
        for process in self.processes.values():
            if process.alive:
                process.alive = False
        if self._arm is not None:
            self._arm.close()

    def _started(self, name: str) -> Process:
        if name == CAMERA:
            self.table.start()
            return self.table.process
        if name == ARM:
            folder = self._folder / 'domain_0'
            folder.mkdir(parents=True, exist_ok=True)
            self._arm = Arm(self.graph, self.table, self._model, folder, self._rng)
            return self._arm.process
        with self.graph.process(name) as process:
            try:
                if name == INFERENCE:
                    InferenceNode()
                else:
                    self._keeper = HoldKeeperNode()
            except (StoreError, ValueError, OSError):
                # It ends with exit code 1.
                process.alive = False
                self.graph.forget(process)
                raise
        if not process.alive:
            # Killed while it started.
            self.graph.after(RESPAWN, lambda: self.start(name))
        return process

    def _hear(self, topic: str, message: Any) -> None:
        self.monitor.hear(topic, message, SIM_TIME.seconds)

    def _observe(self, topic: str, message: Any) -> None:
        if topic in WATCHED:
            self._hear(topic, message)
        if topic == 'decision':
            self.decision = message
        elif topic == 'outcome':
            self.outcome = message
        elif topic == 'goal_belief':
            self.belief = message.object, SIM_TIME.now


#: Topics that the monitor hears as they are published.
WATCHED = frozenset(
    {
        'world', 'table_state', 'demonstration', 'heard', 'goal_belief', 'decision', 'outcome',
        'motion', 'cell/hold_state', 'cell/holds', 'heartbeat', 'joint_states',
    }
)  # fmt: skip
