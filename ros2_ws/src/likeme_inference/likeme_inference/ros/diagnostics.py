"""How the inference node does: what came, what was dropped, whether the camera is silent."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from likeme_core.ros.diagnostics import diagnostics_msg
from likeme_core.ros.time import steady_clock

#: s: one log line for all bad messages of this time; a camera silent for longer, or a message
#: dropped more recently, is worth a warning.
THROTTLE = 5.0
CAMERA_SILENCE = 2.0
RECENT = 10.0


class Health:
    """Counts what happens and says once a second how the node does.

    Publishes /diagnostics (DiagnosticArray), 1 Hz by the steady clock, on behalf of its node.

    Attributes:
        counts: what happened how often since the session began.
    """

    def __init__(
        self, node: Node, arm_ready: Callable[[], bool], facts: Callable[[], Mapping[str, Any]]
    ) -> None:
        """arm_ready: whether the arm's service is there. facts: what else is worth telling."""
        self.counts: Counter[str] = Counter()
        self._node, self._arm_ready, self._facts = node, arm_ready, facts
        self._camera_heard = time.monotonic()
        self._dropped_at = -math.inf
        self._diagnostics_pub = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        node.create_timer(1.0, self._publish, clock=steady_clock())

    @property
    def silence(self) -> float:
        """Seconds since the camera last saw anything new, or was last given time to."""
        return time.monotonic() - self._camera_heard

    def camera_heard(self) -> None:
        """Count the camera's silence from now on."""
        self._camera_heard = time.monotonic()

    def drop(self, what: str, error: ValueError) -> None:
        """Count a message that cannot be used, and say why the last of them could not."""
        self.counts[f'{what} dropped'] += 1
        self._dropped_at = time.monotonic()
        dropped = self.counts[f'{what} dropped']
        self._node.get_logger().warning(
            f'{dropped} {what} dropped so far, the last one because: {error}',
            throttle_duration_sec=THROTTLE,
        )

    def _publish(self) -> None:
        silent = self.silence
        problems = [
            (not self._arm_ready(), 'arm service absent'),
            (silent > CAMERA_SILENCE, f'no new table state for {silent:.0f} s'),
            (time.monotonic() - self._dropped_at < RECENT, 'messages were dropped just now'),
        ]
        said = '; '.join(sentence for there, sentence in problems if there)
        facts = {**self._facts(), **self.counts}
        stamp = self._node.get_clock().now().to_msg()
        level = DiagnosticStatus.WARN if said else DiagnosticStatus.OK
        self._diagnostics_pub.publish(
            diagnostics_msg('inference_node: imitation', level, said or 'ready', facts, stamp)
        )
