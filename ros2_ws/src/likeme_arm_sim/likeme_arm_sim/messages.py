"""Between the cell's values and ROS messages; decides nothing."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from numpy.typing import NDArray
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from sensor_msgs.msg import CameraInfo, Image, JointState

from likeme_arm.motion import ObjectView, Outcome
from likeme_arm_sim.arm import Arm
from likeme_arm_sim.cell import MotionResult
from likeme_arm_sim.driver import Driver
from likeme_arm_sim.node_settings import Setting
from likeme_arm_sim.scene import CameraMount, State
from likeme_msgs.msg import ObjectState, TableState
from likeme_msgs.srv import ExecuteAction

BASE_FRAME = 'base_link'
NANOSECONDS = 1_000_000_000


def time_message(nanoseconds: int) -> Time:
    """Nanoseconds since the epoch as a message."""
    seconds, rest = divmod(nanoseconds, NANOSECONDS)
    return Time(sec=seconds, nanosec=rest)


def nanoseconds(stamp: Time) -> int:
    """A stamp as nanoseconds since the epoch."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def parameter_descriptor(setting: Setting) -> ParameterDescriptor:
    """What ROS is told about a parameter."""
    descriptor = ParameterDescriptor(description=setting.description, read_only=setting.fixed)
    if setting.limits is None:
        return descriptor
    low, high = setting.limits
    if isinstance(setting.default, int):
        descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
    else:
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(low), to_value=float(high))
        ]
    return descriptor


def image_message(pixels: NDArray[np.uint8] | NDArray[np.uint16], encoding: str) -> Image:
    """An image of (H, W[, C]) pixels, without its header.

    `data` is an array.array, the type the message stores: 0.7 ms an image; a list takes 18 ms.
    """
    message = Image(height=pixels.shape[0], width=pixels.shape[1], encoding=encoding)
    message.step = pixels.strides[0]
    message.is_bigendian = 0
    data = array('B')
    data.frombytes(np.ascontiguousarray(pixels).data.cast('B'))
    message.data = data
    return message


def camera_info_message(camera: CameraMount) -> CameraInfo:
    """The true intrinsics of a rectified camera, without header."""
    fx, fy, cx, cy = camera.fx, camera.fy, camera.cx, camera.cy
    message = CameraInfo(height=camera.height, width=camera.width)
    message.distortion_model = 'plumb_bob'
    message.d = [0.0] * 5
    message.k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    message.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    message.p = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    return message


def joint_state_message(arm: Arm, stamp: Time) -> JointState:
    """Angles (rad) and velocities (rad/s) of the arm, and the fingers' places (m)."""
    message = JointState()
    message.header.stamp = stamp
    message.header.frame_id = BASE_FRAME
    message.name = [f'panda_joint{k}' for k in range(1, 8)]
    message.name += ['panda_finger_joint1', 'panda_finger_joint2']
    message.position = [*arm.joints.tolist(), *arm.fingers]
    message.velocity = [*arm.joint_velocities.tolist(), 0.0, 0.0]
    return message


def object_views(message: TableState) -> dict[str, ObjectView]:
    """The objects that were ever seen, by name.

    Raises:
        ValueError: positions are not in base_link.
    """
    if message.reference_frame != BASE_FRAME:
        raise ValueError(
            f"Expected a table_state in '{BASE_FRAME}', got '{message.reference_frame}'."
        )
    return {item.name: _view(item) for item in message.objects if nanoseconds(item.last_seen) > 0}


def _view(item: ObjectState) -> ObjectView:
    known = item.state in list(State)
    state = State(item.state) if known else None
    return ObjectView(item.centroid.x, item.centroid.y, item.major_axis_yaw, state)


def motion_response(
    result: MotionResult, driver: Driver, response: ExecuteAction.Response
) -> ExecuteAction.Response:
    """How a motion ended, on the driver's clock."""
    response.success = result.outcome is Outcome.COMPLETED
    response.outcome, response.message = int(result.outcome), result.message
    if result.started is not None and result.finished is not None:
        response.started = time_message(driver.stamp(result.started))
        response.finished = time_message(driver.stamp(result.finished))
    return response


def diagnostics_message(driver: Driver, counts: Mapping[str, Any]) -> DiagnosticArray:
    """Whether the cell is held, moving or idle, and some counts."""
    held = driver.cell.held
    status = DiagnosticStatus(
        level=DiagnosticStatus.WARN if held else DiagnosticStatus.OK,
        name='arm_driver',
        message='held' if held else 'moving' if driver.busy else 'idle',
        hardware_id='simulated cell',
    )
    age = driver.sightings.age(driver.now)
    values = {**counts, 'errors': driver.errors, 'table_state_age_s': f'{age:.2f}'}
    status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    message = DiagnosticArray(status=[status])
    message.header.stamp = time_message(driver.now)
    return message
