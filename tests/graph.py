"""Helpers for tests of the graph: node processes on their own ROS domain, waits with bounds.

with Graph(tmp_path) as graph:
    process = graph.start('likeme_inference.inference_node', mode='goal_based')
    decisions = graph.collect(Decision, 'decision', LATCHED)
    graph.until(lambda: decisions, 10, 'a decision')
"""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import rclpy
from domain_coordinator import domain_id
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from likeme_core.processes import die_with_parent

#: Without it nothing moves.
HOLD_KEEPER = 'likeme_arm.hold_keeper_node'
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
#: s in which a node process must have ended after SIGINT.
GRACE = 30.0
#: Bounds are named for an idle machine; this many times longer is waited before a test fails.
SLACK = 5


def ros_arguments(parameters: Mapping[str, Any]) -> list[str]:
    """Words of a command line that set ROS parameters."""
    values = [f'{name}:={json.dumps(value)}' for name, value in parameters.items()]
    words = [word for value in values for word in ('-p', value)]
    return ['--ros-args', *words] if words else []


class NodeProcess:
    """A process of the graph, in a process group of its own, with all it says in a file.

    The kernel ends it with this process, so that no node of an interrupted test is left.
    """

    def __init__(self, command: list[str], log: Path, env: Mapping[str, str]) -> None:
        self.log = log
        with log.open('wb') as out:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                env=dict(env),
                start_new_session=True,
                preexec_fn=die_with_parent(os.getpid()),
            )

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def said(self) -> str:
        """All it printed so far."""
        return self.log.read_text(encoding='utf-8', errors='replace')

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the process and its children."""
        if self.alive:
            os.killpg(self._process.pid, number)

    def stop(self) -> int:
        """End it as Ctrl-C does, or by force after a while; the exit code."""
        self.signal(signal.SIGCONT)
        self.signal(signal.SIGINT)
        try:
            return self._process.wait(GRACE)
        except subprocess.TimeoutExpired:
            self.signal(signal.SIGKILL)
            return self._process.wait(GRACE)

    def wait(self, timeout: float) -> int:
        """Wait for it to end by itself, see SLACK; the exit code."""
        return self._process.wait(SLACK * timeout)


class Graph:
    """One ROS domain for one test: a node in this process, and processes that end with it.

    Attributes:
        node: this test's own node, spun by `until` and `call`.
    """

    def __init__(self, log_folder: Path) -> None:
        self._logs = log_folder
        self._stack = ExitStack()
        self._processes: list[NodeProcess] = []

    def __enter__(self) -> Self:
        self.domain = self._stack.enter_context(domain_id())
        self.env = os.environ | {
            'ROS_DOMAIN_ID': str(self.domain),
            'PYTHONUNBUFFERED': '1',
            # Domains are used again by later tests: what one cell remembers is not for the next.
            'LIKEME_STATE': str(self._logs / 'state'),
        }
        self._context = rclpy.Context()
        self._context.init(domain_id=self.domain)
        self._stack.callback(self._context.try_shutdown)
        self.node = Node('test', context=self._context, start_parameter_services=False)
        self._stack.callback(self.node.destroy_node)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._stack.callback(self._executor.shutdown)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for process in reversed(self._processes):
            process.stop()
        if error is not None:
            for process in self._processes:
                error.add_note(f'--- {process.log.name}\n{process.said}')
        self._stack.close()

    def background_node(self, name: str) -> Node:
        """Create a node that a thread of its own spins, so that its callbacks may block."""
        node = Node(name, context=self._context, start_parameter_services=False)
        executor = SingleThreadedExecutor(context=self._context)
        executor.add_node(node)
        thread = threading.Thread(target=executor.spin, daemon=True)
        self._stack.callback(node.destroy_node)
        self._stack.callback(thread.join, GRACE)
        self._stack.callback(executor.shutdown)
        thread.start()
        return node

    def run(self, name: str, *command: str) -> NodeProcess:
        """Start any command on this domain."""
        log = self._logs / f'{len(self._processes)}_{name}.log'
        process = NodeProcess(list(command), log, self.env)
        self._processes.append(process)
        return process

    def start(self, module: str, *arguments: str, **parameters: Any) -> NodeProcess:
        """Start a Python module as a node, with ROS parameters."""
        command = [sys.executable, '-m', module, *arguments, *ros_arguments(parameters)]
        return self.run(module.rpartition('.')[2], *command)

    def until(self, condition: Callable[[], Any], timeout: float, what: str) -> Any:
        """Spin until a condition holds and give its value; fail with what was waited for.

        timeout: s, see SLACK.
        """
        deadline = time.monotonic() + SLACK * timeout
        while not (value := condition()):
            left = deadline - time.monotonic()
            if left <= 0:
                raise AssertionError(f'Expected {what} within {SLACK * timeout:g} s, got nothing.')
            self._executor.spin_once(timeout_sec=min(left, 0.05))
        return value

    def during(self, seconds: float) -> None:
        """Spin for a while, to see that nothing happens."""
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= end, seconds + 1, 'time to pass')

    def collect(self, kind: type, topic: str, qos: QoSProfile | int = 10) -> list[Any]:
        """Subscribe; the list grows with every message while the test spins."""
        received: list[Any] = []
        self.node.create_subscription(kind, topic, received.append, qos)
        return received

    def publisher(self, kind: type, topic: str, qos: QoSProfile | int = 10) -> Any:
        """Create a publisher and wait for its first subscriber."""
        publisher = self.node.create_publisher(kind, topic, qos)
        self.until(lambda: publisher.get_subscription_count(), 20, f'a subscriber of {topic}')
        return publisher

    def send(self, kind: type, service: str, request: Any, timeout: float = 20) -> Any:
        """Call a service once it is there; the future of the response."""
        return self._client(kind, service, timeout).call_async(request)

    def call(
        self, kind: type, service: str, request: Any, timeout: float = 20, again: float = math.inf
    ) -> Any:
        """Call a service once it is there; the response.

        again: s after which the request is sent once more. What is sent while a killed server is
        still listed is lost; only for requests that may arrive twice.
        """
        client = self._client(kind, service, timeout)
        futures, due = [client.call_async(request)], time.monotonic() + again

        def answered() -> bool:
            nonlocal due
            if time.monotonic() > due:
                futures.append(client.call_async(request))
                due += again
            return any(future.done() for future in futures)

        self.until(answered, timeout, f'an answer of {service}')
        self.node.destroy_client(client)
        return next(future.result() for future in futures if future.done())

    def _client(self, kind: type, service: str, timeout: float) -> Any:
        client = self.node.create_client(kind, service)
        self.until(client.service_is_ready, timeout, f'the service {service}')
        return client
