"""Diagnostics of the inference node: message counts, dropped messages, missing table states."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from likeme_core.ros.diagnostics import DiagnosticsPublisher, diagnostics_msg
from likeme_core.ros.time import steady_clock

#: s between two log messages about dropped messages.
LOG_PERIOD = 5.0
#: s without a new table state, and s since a dropped message, for a warning in /diagnostics.
TABLE_STATE_WARNING = 2.0
DROP_WARNING = 10.0


class SessionDiagnostics:
    """Counts events of a session and publishes /diagnostics (DiagnosticArray, 1 Hz, steady clock).

    Attributes:
        counts: events by name since the session started.
    """

    def __init__(
        self,
        node: Node,
        problems: Callable[[], list[str]],
        facts: Callable[[], Mapping[str, Any]],
    ) -> None:
        """problems: further reasons for a warning. facts: further values to publish."""
        self.counts: Counter[str] = Counter()
        self._node, self._problems, self._facts = node, problems, facts
        self._camera_heard = time.monotonic()
        self._dropped_at = -math.inf
        self._diagnostics_pub = DiagnosticsPublisher(node)
        node.create_timer(1.0, self._publish, clock=steady_clock())

    @property
    def silence(self) -> float:
        """Seconds since the last new table state or call of `camera_heard`."""
        return time.monotonic() - self._camera_heard

    def camera_heard(self) -> None:
        """Restart the count of `silence`."""
        self._camera_heard = time.monotonic()

    def drop(self, what: str, error: ValueError) -> None:
        """Count a message that cannot be used, and log the reason."""
        self.counts[f'{what} dropped'] += 1
        self._dropped_at = time.monotonic()
        dropped = self.counts[f'{what} dropped']
        self._node.get_logger().warning(
            f'{dropped} {what} dropped so far, the last one because: {error}',
            throttle_duration_sec=LOG_PERIOD,
        )

    def _publish(self) -> None:
        silent = self.silence
        problems = [
            (silent > TABLE_STATE_WARNING, f'no new table state for {silent:.0f} s'),
            (time.monotonic() - self._dropped_at < DROP_WARNING, 'messages were dropped just now'),
        ]
        present = [sentence for there, sentence in problems if there]
        message = '; '.join([*self._problems(), *present])
        facts = {**self._facts(), **self.counts}
        stamp = self._node.get_clock().now().to_msg()
        level = DiagnosticStatus.WARN if message else DiagnosticStatus.OK
        self._diagnostics_pub.publish(
            diagnostics_msg('inference_node: imitation', level, message or 'ready', facts, stamp)
        )
