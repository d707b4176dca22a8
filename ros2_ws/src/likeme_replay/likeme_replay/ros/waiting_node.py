"""A node that is spun by its owner while the owner waits for a condition."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from likeme_core.cli import set_discovery


class ReplayFailedError(Exception):
    """The replay cannot begin or continue: expected and got."""


class WaitingNode(Node):
    """Has no thread: callbacks run while `spin`, `wait` or `require` is called."""

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, start_parameter_services=False, **options)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self)

    def close(self) -> None:
        """Destroy the node and its executor."""
        self._executor.shutdown()
        self.destroy_node()

    def require(self, condition: Callable[[], Any], seconds: float, sentence: str) -> None:
        """Wait until a condition holds; ReplayFailedError with the sentence on timeout."""
        if not self.wait(condition, seconds):
            raise ReplayFailedError(sentence)

    def wait(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Wait until a condition holds, at most so many s; whether it does."""
        deadline = time.monotonic() + seconds
        while not condition():
            left = deadline - time.monotonic()
            if left <= 0:
                return False
            self.spin(min(left, 0.1))
        return True

    def spin(self, seconds: float) -> None:
        """Run one callback, the first that is ready within so many s."""
        self._executor.spin_once(timeout_sec=seconds)


Kind = TypeVar('Kind', bound=WaitingNode)


@contextmanager
def node_on_domain(create: Callable[[], Kind], domain: int, network: bool) -> Iterator[Kind]:
    """A node on a ROS domain of this host, or of the subnet; signals stay the caller's."""
    set_discovery(network)
    rclpy.init(args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = create()
        try:
            yield node
        finally:
            node.close()
    finally:
        rclpy.try_shutdown()
