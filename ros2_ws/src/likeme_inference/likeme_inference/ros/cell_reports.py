"""Holds, resumes and motions of the cell, by whomever they were caused, for the decision log."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.ros.qos import kept
from likeme_core.ros.time import stamp_ns
from likeme_inference.arm_motion import MotionState
from likeme_inference.cell_report_filter import CellReportFilter
from likeme_msgs.msg import HoldState, Motion

#: Of topics whose last messages are kept for those who come later.
KEPT = kept(100)


class CellReports:
    """Subscribes cell/holds (HoldState) and motion (Motion), each reliable, transient local."""

    def __init__(
        self, node: Node, known: CellReportFilter, note: Callable[[str, dict[str, Any]], None]
    ) -> None:
        """known: leaves out what was noted before. note: takes kind and fields of an entry."""
        self._known, self._note = known, note
        node.create_subscription(HoldState, 'cell/holds', self._on_hold, KEPT)
        node.create_subscription(Motion, 'motion', self._on_motion, KEPT)

    def _on_hold(self, msg: HoldState) -> None:
        self._take(
            'hold' if msg.held else 'resume',
            {
                'change': msg.change,
                'by': msg.by,
                'reason': msg.reason,
                'keeper': msg.run,
                'stamp': stamp_ns(msg.header.stamp),
            },
        )

    def _on_motion(self, msg: Motion) -> None:
        self._take(
            'motion',
            {
                'id': msg.id,
                'state': _name(MotionState, msg.state),
                'actor': _name(Actor, msg.actor),
                'motion_world': msg.world,
                'object': msg.object,
                'action': msg.action,
                'outcome': _name(MotionOutcome, msg.outcome) if msg.state == Motion.ENDED else '',
                'message': msg.message,
                'stamp': stamp_ns(msg.header.stamp),
                'started': stamp_ns(msg.started),
                'finished': stamp_ns(msg.finished),
            },
        )

    def _take(self, kind: str, data: dict[str, Any]) -> None:
        if self._known.is_new(kind, data):
            self._note(kind, data)


def _name(numbers: Any, value: int) -> str:
    return str(numbers(value).name) if value in set(numbers) else str(value)
