"""A node that is spun by its owner while the owner waits for a condition."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node


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
