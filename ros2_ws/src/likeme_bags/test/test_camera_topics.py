"""Topics of many drivers: three of one camera and one size."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from likeme_bags.camera_topics import (
    CAMERA_INFO,
    COLOUR,
    DEPTH,
    INFO,
    camera_remap,
    camera_role,
    without_slash,
)
from likeme_bags.errors import BagError
from likeme_bags.images import IMAGE
from likeme_bags.reading import open_bag
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

BEGIN = 1_700_000_000_000_000_000
STRING = 'std_msgs/msg/String'
SMALL, LARGE = (58, 64), (72, 128)


def message(topic: str, kind: str, size: tuple[int, int]) -> bytes:
    """An image, camera_info or text of a topic."""
    types: Any = jazzy().types
    header = types['std_msgs/msg/Header'](types['builtin_interfaces/msg/Time'](1, 0), topic)
    rows, columns = size
    if kind == CAMERA_INFO:
        roi = types['sensor_msgs/msg/RegionOfInterest'](0, 0, 0, 0, False)
        made = types[kind](
            header, rows, columns, 'plumb_bob', np.zeros(5), np.zeros(9), np.zeros(9),
            np.zeros(12), 0, 0, roi,
        )  # fmt: skip
    elif kind == IMAGE:
        data = np.zeros(rows * columns, np.uint8)
        made = types[kind](header, rows, columns, 'mono8', 0, columns, data)
    else:
        made = types[kind](topic)
    return bytes(jazzy().serialize_cdr(made, kind))


def remap_of(
    folder: Path,
    topics: dict[str, tuple[int, int]],
    given: dict[str, str] | None = None,
    **other_types: str,
) -> dict[str, str]:
    """What a bag of these topics is remapped to; a topic's type is told by its name."""
    with BagWriter(folder / 'bag') as writer:
        for name, size in topics.items():
            kind = CAMERA_INFO if name.endswith('camera_info') else IMAGE
            kind = other_types.get(name.rpartition('/')[2], kind)
            writer.add(Topic(name, kind))
            writer.write(Record(name, kind, BEGIN, message(name, kind, size)))
    with open_bag(folder / 'bag') as bag:
        return camera_remap(bag, given)


def chosen(remap: dict[str, str]) -> list[str]:
    """The topics chosen as colour, depth and info."""
    roles = {without_slash(new): old for old, new in remap.items()}
    return [roles[role] for role in (COLOUR, DEPTH, INFO)]


@pytest.mark.parametrize(
    'names',
    [
        # The cell, OpenNI, ROS 1, TUM RGB-D, Toyota HSR, Xtion.
        (f'/{COLOUR}', f'/{DEPTH}', f'/{INFO}'),
        ('/camera/rgb/image_raw', '/camera/depth_registered/image_raw', '/camera/rgb/camera_info'),
        ('/camera/rgb/image_rect_color', '/camera/depth_registered/hw_registered/image_rect_raw',
         '/camera/depth_registered/camera_info'),
        ('/camera/rgb/image_color', '/camera/depth/image', '/camera/rgb/camera_info'),
        ('/camera/rgb/image_color', '/camera/depth/image', '/camera/depth/camera_info'),
        ('/hsrb/head_rgbd_sensor/rgb/image_rect_color',
         '/hsrb/head_rgbd_sensor/depth_registered/image_rect_raw',
         '/hsrb/head_rgbd_sensor/rgb/camera_info'),
        ('/xtion/rgb/image_raw', '/xtion/depth_registered/image_raw', '/xtion/rgb/camera_info'),
        # RealSense: before 4.54, since, and under names of one's own.
        ('/camera/color/image_raw', '/camera/aligned_depth_to_color/image_raw',
         '/camera/color/camera_info'),
        ('/camera/camera/color/image_raw', '/camera/camera/aligned_depth_to_color/image_raw',
         '/camera/camera/color/camera_info'),
        ('/robot/d435/color/image_raw', '/robot/d435/aligned_depth_to_color/image_raw',
         '/robot/d435/aligned_depth_to_color/camera_info'),
        # Kinect v2, Azure Kinect in both images.
        ('/kinect2/hd/image_color_rect', '/kinect2/hd/image_depth_rect',
         '/kinect2/hd/camera_info'),
        ('/rgb/image_raw', '/depth_to_rgb/image_raw', '/rgb/camera_info'),
        ('/k4a/rgb_to_depth/image_raw', '/k4a/depth/image_raw', '/k4a/depth/camera_info'),
        # OAK, ZED, Orbbec, simulators.
        ('/oak/rgb/image_raw', '/oak/stereo/image_raw', '/oak/rgb/camera_info'),
        ('/color/video/image', '/stereo/depth', '/color/video/camera_info'),
        ('/zed/zed_node/rgb/image_rect_color', '/zed/zed_node/depth/depth_registered',
         '/zed/zed_node/rgb/camera_info'),
        ('/zed/zed_node/rgb/color/rect/image', '/zed/zed_node/depth/depth_registered',
         '/zed/zed_node/rgb/color/rect/camera_info'),
        ('/camera/color/image_raw', '/camera/depth/image_raw', '/camera/color/camera_info'),
        ('/rgbd_camera/image', '/rgbd_camera/depth_image', '/rgbd_camera/camera_info'),
        ('/camera/image_raw', '/camera/depth/image_raw', '/camera/camera_info'),
        ('/rgb', '/depth', '/camera_info'),
    ],
)  # fmt: skip
def test_topics_of_a_known_camera_are_found(names: tuple[str, str, str], tmp_path: Path) -> None:
    topics = {'/joint/image': SMALL, **dict.fromkeys(names, LARGE)}
    assert chosen(remap_of(tmp_path, topics)) == list(names)


def test_an_azure_kinects_topics_are_of_one_image(tmp_path: Path) -> None:
    """With all its topics in the bag, in the order of their names."""
    topics = {
        '/depth/camera_info': SMALL, '/depth/image_raw': SMALL, '/depth_to_rgb/image_raw': LARGE,
        '/rgb/camera_info': LARGE, '/rgb/image_raw': LARGE, '/rgb_to_depth/image_raw': SMALL,
    }  # fmt: skip
    found = chosen(remap_of(tmp_path, topics))
    assert found == ['/rgb/image_raw', '/depth_to_rgb/image_raw', '/rgb/camera_info']


def test_an_azure_kinect_without_depth_in_the_colour_image(tmp_path: Path) -> None:
    topics = {
        '/depth/camera_info': SMALL, '/depth/image_raw': SMALL, '/rgb/camera_info': LARGE,
        '/rgb/image_raw': LARGE, '/rgb_to_depth/image_raw': SMALL,
    }  # fmt: skip
    found = chosen(remap_of(tmp_path, topics))
    assert found == ['/rgb_to_depth/image_raw', '/depth/image_raw', '/depth/camera_info']


@pytest.mark.parametrize('first', ['left', 'right'])
def test_topics_of_two_cameras_are_not_mixed(first: str, tmp_path: Path) -> None:
    """The first in the bag is taken, or the one that is asked for."""
    cameras = [first, 'right' if first == 'left' else 'left']
    names = ('color/image_raw', 'aligned_depth_to_color/image_raw', 'color/camera_info')
    topics = {f'/{camera}/{name}': LARGE for name in names for camera in cameras}
    (found,) = {name.split('/')[1] for name in chosen(remap_of(tmp_path, topics))}
    assert found == sorted(cameras)[0] or found == first
    given = {'/right/color/image_raw': COLOUR}
    assert chosen(remap_of(tmp_path / 'given', topics, given)) == [f'/right/{n}' for n in names]


def test_a_size_that_differs_is_avoided_where_there_is_a_choice(tmp_path: Path) -> None:
    topics = {
        '/camera/rgb/image_rect_color': SMALL, '/camera/rgb/image_raw': LARGE,
        '/camera/depth_registered/image_raw': LARGE, '/camera/rgb/camera_info': LARGE,
    }  # fmt: skip
    assert chosen(remap_of(tmp_path, topics))[0] == '/camera/rgb/image_raw'


def test_what_is_missing_or_of_another_type_is_named(tmp_path: Path) -> None:
    raw, info = '/camera/camera/color/image_raw', '/camera/camera/color/camera_info'
    unaligned = '/camera/camera/depth/image_rect_raw'
    with pytest.raises(BagError, match=rf'Expected {DEPTH} of .*, got .*{unaligned}'):
        remap_of(tmp_path / 'unaligned', {raw: LARGE, unaligned: LARGE, info: LARGE})
    aligned = '/camera/camera/aligned_depth_to_color/image_raw'
    topics = {raw: LARGE, aligned: LARGE, info: LARGE}
    with pytest.raises(BagError, match=rf'{info} as {INFO}: expected {CAMERA_INFO}, got {STRING}'):
        remap_of(tmp_path / 'typed', topics, camera_info=STRING)


def test_roles_of_usual_names() -> None:
    assert camera_role('/camera/color/image_raw/compressed') == COLOUR
    assert camera_role('kinect2/qhd/image_depth_rect/compressedDepth') == DEPTH
    assert camera_role('/camera/camera/color/camera_info') == INFO
    assert camera_role('/front/image') == camera_role('/image') == ''
