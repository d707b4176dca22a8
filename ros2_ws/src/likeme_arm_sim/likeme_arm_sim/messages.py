"""Between the cell's values and ROS messages; decides nothing."""

from __future__ import annotations

from array import array

import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image, JointState

from likeme_arm_sim.arm import Arm
from likeme_arm_sim.primitives import ObjectView
from likeme_arm_sim.scene import CameraMount, State
from likeme_msgs.msg import ObjectState, TableState

CAMERA_FRAME = 'camera_rgb_optical_frame'
BASE_FRAME = 'base_link'
NANOSECONDS = 1_000_000_000


def time_message(nanoseconds: int) -> Time:
    """Nanoseconds since the epoch as a message."""
    seconds, rest = divmod(nanoseconds, NANOSECONDS)
    return Time(sec=seconds, nanosec=rest)


def nanoseconds(stamp: Time) -> int:
    """A stamp as nanoseconds since the epoch."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


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


def initial_states(pairs: list[str]) -> dict[str, State]:
    """['pear:RIGHT', ...] as a mapping.

    Raises:
        ValueError: a pair is not of that form.
    """
    states = {}
    for pair in pairs:
        name, _, state = pair.partition(':')
        if state not in State.__members__:
            raise ValueError(f"Expected initial_states like 'pear:RIGHT', got '{pair}'.")
        states[name] = State[state]
    return states
