"""Conversion to and from ROS messages."""

from __future__ import annotations

import numpy as np

from likeme_arm_sim import messages
from likeme_core.paper_world import WORLD
from likeme_core.ros.time import stamp_ns, time_msg


def test_images_keep_their_pixels() -> None:
    depth = np.arange(12, dtype=np.uint16).reshape(3, 4) * 1000
    message = messages.image_message(depth, '16UC1')
    assert (message.height, message.width, message.step) == (3, 4, 8)
    assert np.array_equal(np.frombuffer(message.data, np.uint16).reshape(3, 4), depth)
    rgb = messages.image_message(np.zeros((3, 4, 3), np.uint8), 'rgb8')
    assert (rgb.step, len(rgb.data), rgb.encoding) == (12, 36, 'rgb8')


def test_camera_info_has_the_true_intrinsics() -> None:
    camera = WORLD.camera
    info = messages.camera_info_message(camera)
    assert (info.width, info.height) == (640, 480)
    assert (info.k[0], info.k[2], info.k[4], info.k[5]) == (525.0, 319.5, 525.0, 239.5)
    assert info.p[5] == camera.fy
    assert info.distortion_model == 'plumb_bob'


def test_times_go_there_and_back() -> None:
    assert stamp_ns(time_msg(1_700_000_000_123_456_789)) == (1_700_000_000_123_456_789)
