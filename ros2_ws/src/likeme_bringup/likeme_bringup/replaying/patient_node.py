"""A node whose owner waits: it spins itself, until something holds or patience ends."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node


class NotPlayedError(Exception):
    """The replay cannot begin or go on: what was expected and what came."""


class PatientNode(Node):
    """Without threads: nothing is received but while somebody waits."""

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, start_parameter_services=False, **options)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self)

    def close(self) -> None:
        """Let go of the network."""
        self._executor.shutdown()
        self.destroy_node()

    def _until(self, condition: Callable[[], Any], seconds: float, sentence: str) -> None:
        if not self._wait(condition, seconds):
            raise NotPlayedError(sentence)

    def _wait(self, condition: Callable[[], Any], seconds: float) -> bool:
        deadline = time.monotonic() + seconds
        while not condition():
            left = deadline - time.monotonic()
            if left <= 0:
                return False
            self._spin(min(left, 0.1))
        return True

    def _spin(self, seconds: float) -> None:
        self._executor.spin_once(timeout_sec=seconds)
