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

    def until(self, condition: Callable[[], Any], seconds: float, sentence: str) -> None:
        """Wait until something holds; NotPlayedError with the sentence after so many s."""
        if not self.wait(condition, seconds):
            raise NotPlayedError(sentence)

    def wait(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Wait until something holds, for so many s at most; whether it does."""
        deadline = time.monotonic() + seconds
        while not condition():
            left = deadline - time.monotonic()
            if left <= 0:
                return False
            self.spin(min(left, 0.1))
        return True

    def spin(self, seconds: float) -> None:
        """Receive what has come, or what comes first within so many s."""
        self._executor.spin_once(timeout_sec=seconds)
