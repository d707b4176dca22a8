"""Conversion to and from ROS messages."""

from __future__ import annotations

import numpy as np
import pytest
from geometry_msgs.msg import Point

from likeme_arm.motion import ObjectView
from likeme_arm_sim import messages
from likeme_core.paper_world import RIGHT, WORLD
from likeme_core.ros.time import stamp_ns, time_msg
from likeme_msgs.msg import ObjectState, TableState


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


def table(frame: str = 'base_link') -> TableState:
    seen = time_msg(5)
    objects = [
        ObjectState(name='pear', state=1, centroid=Point(x=0.4, y=-0.1), major_axis_yaw=0.5),
        ObjectState(name='lemon', state=ObjectState.UNKNOWN, centroid=Point(x=0.4, y=0.1)),
        ObjectState(name='chicken', state=2, centroid=Point(x=float('nan'))),
    ]
    for item in objects[:2]:
        item.last_seen = seen
    return TableState(reference_frame=frame, objects=objects)


def test_views_are_of_what_was_ever_seen() -> None:
    views = messages.object_views(table(), WORLD)
    assert set(views) == {'pear', 'lemon'}
    assert views['pear'] == ObjectView(0.4, -0.1, 0.5, RIGHT)
    assert views['lemon'].state is None


def test_other_frames_are_refused() -> None:
    with pytest.raises(ValueError, match="'base_link', got 'map'"):
        messages.object_views(table('map'), WORLD)
