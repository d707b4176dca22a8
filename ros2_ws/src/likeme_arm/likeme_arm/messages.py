"""Conversion between the values of a driver and ROS messages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from likeme_arm.hold_monitor import Block
from likeme_arm.motion import ObjectView
from likeme_arm.motion_driver import MotionDriver, StampedResult
from likeme_arm.motion_journal import MotionRecord
from likeme_core.outcomes import MotionOutcome
from likeme_core.ros.diagnostics import diagnostics_msg
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_core.world import World
from likeme_msgs.action import ExecuteAction as ExecuteActionAction
from likeme_msgs.msg import Motion, ObjectState, TableState
from likeme_msgs.srv import ExecuteAction

BASE_FRAME = 'base_link'
MotionAnswer = TypeVar('MotionAnswer', ExecuteAction.Response, ExecuteActionAction.Result)


def object_views(message: TableState, world: World) -> dict[str, ObjectView]:
    """The objects that were ever seen, by name.

    Raises:
        ValueError: it is of another world, or positions are not in base_link.
    """
    world.check_label(message.world)
    if message.reference_frame != BASE_FRAME:
        raise ValueError(
            f"Expected a table_state in '{BASE_FRAME}', got '{message.reference_frame}'."
        )
    return {
        item.name: _view(item, world) for item in message.objects if stamp_ns(item.last_seen) > 0
    }


def unknown_views(message: TableState) -> dict[str, ObjectView]:
    """What lies on the table and is no object of the world, by names that no request can have."""
    return {
        f'unknown object {number}': ObjectView(
            item.centroid.x, item.centroid.y, item.major_axis_yaw, None,
            item.major_axis_length, item.minor_axis_length, item.height,
        )
        for number, item in enumerate(message.unknown_objects, start=1)
    }  # fmt: skip


def _view(item: ObjectState, world: World) -> ObjectView:
    state = world.state_at(item.state)
    return ObjectView(
        item.centroid.x, item.centroid.y, item.major_axis_yaw, state,
        item.major_axis_length, item.minor_axis_length, item.height,
    )  # fmt: skip


def motion_response(report: StampedResult, response: MotionAnswer) -> MotionAnswer:
    """How a motion ended, as the response of the service or the result of the action."""
    response.success = report.outcome is MotionOutcome.COMPLETED
    response.outcome, response.message = int(report.outcome), report.message
    response.started, response.finished = time_msg(report.started), time_msg(report.finished)
    return response


def motion_msg(record: MotionRecord, now: int) -> Motion:
    """A request to move, reported at `now` (ns)."""
    message = Motion(
        id=record.id, actor=int(record.actor), world=record.world, object=record.object,
        action=record.action, message=record.message, started=time_msg(record.started),
        finished=time_msg(record.finished),
    )  # fmt: skip
    message.header.stamp = time_msg(now)
    message.state = Motion.UNDER_WAY if record.outcome is None else Motion.ENDED
    if record.outcome is not None:
        message.outcome = int(record.outcome)
    return message


def diagnostics_message(
    driver: MotionDriver,
    counts: Mapping[str, Any],
    hardware: str,
    conflicts: Sequence[str] = (),
) -> DiagnosticArray:
    """Whether a driver is held, moving or idle, and some counts; an ERROR for each conflict."""
    block = driver.block
    if conflicts:
        level, message = DiagnosticStatus.ERROR, ' '.join(conflicts)
    else:
        level = DiagnosticStatus.OK if block is None else DiagnosticStatus.WARN
        message = _ACTIVITY[block] if block else 'moving' if driver.busy else 'idle'
    age = driver.perceived.age(driver.now)
    values = {**counts, 'errors': driver.errors, 'table_state_age_s': f'{age:.2f}'}
    stamp = time_msg(driver.now)
    return diagnostics_msg('arm_driver', level, message, values, stamp, hardware)


_ACTIVITY = {
    Block.HELD: 'held',
    Block.STOPPED: 'stopped',
    Block.UNHEARD: 'the hold keeper is not heard',
}
