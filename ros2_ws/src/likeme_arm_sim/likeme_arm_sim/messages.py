"""Conversion between the simulated cell's values and ROS messages."""

from __future__ import annotations

from array import array

import cv2
import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState

from likeme_arm.messages import BASE_FRAME
from likeme_arm_sim.arm import Arm
from likeme_core.camera_mount import CameraMount
from likeme_core.outcomes import ResetOutcome


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


def compressed_colour(rgb: NDArray[np.uint8]) -> CompressedImage:
    """(H, W, 3) RGB as JPEG, as image_transport's `compressed` sends it, without its header."""
    _, jpeg = cv2.imencode('.jpg', cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))
    return CompressedImage(format='rgb8; jpeg compressed bgr8', data=jpeg.tobytes())


def compressed_depth(depth_mm: NDArray[np.uint16]) -> CompressedImage:
    """(H, W) mm as PNG, as image_transport's `compressedDepth` sends it, without its header."""
    _, png = cv2.imencode('.png', depth_mm, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    # Its header says how 32FC1 was packed: nothing for 16UC1.
    return CompressedImage(format='16UC1; compressedDepth png', data=bytes(12) + png.tobytes())


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
    """Angles (rad) and velocities (rad/s) of the arm, and the fingers' positions (m)."""
    message = JointState()
    message.header.stamp = stamp
    message.header.frame_id = BASE_FRAME
    message.name = [f'panda_joint{k}' for k in range(1, 8)]
    message.name += ['panda_finger_joint1', 'panda_finger_joint2']
    message.position = [*arm.joints.tolist(), *arm.fingers]
    message.velocity = [*arm.joint_velocities.tolist(), 0.0, 0.0]
    return message


def reset_outcome(error: BaseException | None) -> ResetOutcome:
    """The outcome code of a reset that ended with this error; a ValueError is a refusal."""
    if error is None:
        return ResetOutcome.COMPLETED
    return ResetOutcome.INVALID_REQUEST if isinstance(error, ValueError) else ResetOutcome.FAILED
