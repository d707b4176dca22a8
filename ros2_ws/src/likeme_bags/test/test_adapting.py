"""Bags of other cameras, read as the cell's own."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from sample_bags import BEGIN, STRING, sample_records, text_record

from likeme_bags.adapting import Adaptation
from likeme_bags.camera_topics import COLOUR, DEPTH, INFO, camera_remap
from likeme_bags.errors import BagError
from likeme_bags.images import COMPRESSED, IMAGE, decode_image
from likeme_bags.reading import open_bag
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter

CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'


def kinect2(folder: Path, colour: str = '/kinect2/qhd/image_color_rect/compressed') -> Path:
    """A bag as a Kinect v2 driver would fill it: colour compressed, depth raw."""
    types = jazzy().types
    header = types['std_msgs/msg/Header'](types['builtin_interfaces/msg/Time'](1, 0), 'k')
    picture = cv2.imencode('.png', np.full((12, 16, 3), (10, 20, 200), np.uint8))[1]
    message = types[COMPRESSED](header, 'bgr8; png compressed', picture)
    depth = next(r for r in sample_records(1) if r.topic.endswith('depth/image'))
    empty = np.zeros(9)
    roi = types['sensor_msgs/msg/RegionOfInterest'](0, 0, 0, 0, False)
    info = types[CAMERA_INFO](
        header, 12, 16, 'plumb_bob', np.zeros(5), empty, empty, np.zeros(12), 0, 0, roi
    )
    records = [
        Record(colour, COMPRESSED, BEGIN, bytes(jazzy().serialize_cdr(message, COMPRESSED))),
        Record('/kinect2/qhd/image_depth_rect', IMAGE, BEGIN + 1, depth.data),
        Record(
            '/kinect2/qhd/camera_info',
            CAMERA_INFO,
            BEGIN + 2,
            bytes(jazzy().serialize_cdr(info, CAMERA_INFO)),
        ),
    ]
    with BagWriter(folder / 'kinect2') as writer:
        for record in records:
            writer.add(Topic(record.topic, record.type))
            writer.write(record)
    return folder / 'kinect2'


def test_a_kinect2_bag_plays_to_the_cell(tmp_path: Path) -> None:
    with open_bag(kinect2(tmp_path)) as bag:
        adaptation = Adaptation(camera_remap(bag))
        records = list(adaptation.records(bag))
        topics = {(t.name, t.type) for t in adaptation.topics(bag)}
    assert topics == {(COLOUR, IMAGE), (DEPTH, IMAGE), (INFO, CAMERA_INFO)}
    assert {(r.topic, r.type) for r in records} == topics
    picture = decode_image(records[0])
    np.testing.assert_array_equal(picture.pixels[0, 0], (200, 20, 10))
    assert [r.stamp - BEGIN for r in records] == [0, 1, 2]


@pytest.mark.parametrize('encoding', ['rgb16', 'bgr16', 'rgb8', 'mono8'])
def test_colour_that_perception_cannot_read_is_converted(tmp_path: Path, encoding: str) -> None:
    """16-bit colour becomes rgb8; what it can read, and what has no colour, stays as it is."""
    wide = encoding.endswith('16')
    pixels = np.full((12, 16, 1 if encoding == 'mono8' else 3), 200, np.uint8)
    data = (pixels.astype(np.uint16) * 256 if wide else pixels).view(np.uint8).reshape(-1)
    types = jazzy().types
    header = types['std_msgs/msg/Header'](types['builtin_interfaces/msg/Time'](1, 0), 'k')
    message = types[IMAGE](header, 12, 16, encoding, 0, data.size // 12, data)
    record = Record('/eye', IMAGE, BEGIN, bytes(jazzy().serialize_cdr(message, IMAGE)))
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add(Topic('/eye', IMAGE))
        writer.write(record)
    with open_bag(tmp_path / 'bag') as bag:
        new = next(Adaptation({'/eye': COLOUR}).records(bag))
    assert (new.topic, new.type, new.stamp) == (COLOUR, IMAGE, BEGIN)
    image = decode_image(new)
    if wide:
        assert jazzy().deserialize_cdr(new.data, IMAGE).encoding == 'rgb8'
        assert (image.pixels == 200).all()
    else:
        assert new.data == record.data


def test_two_topics_of_one_new_name_are_refused(tmp_path: Path) -> None:
    with open_bag(kinect2(tmp_path, COLOUR)) as bag:
        for remap in (
            {'/kinect2/qhd/camera_info': 'x', '/kinect2/qhd/image_depth_rect': '/x'},
            {'/kinect2/qhd/image_depth_rect': f'/{COLOUR}'},
        ):
            with pytest.raises(BagError, match=r'Expected one topic as .*; give one another name'):
                Adaptation(remap).topics(bag)


def test_names_nobody_knows_are_given(tmp_path: Path) -> None:
    with open_bag(kinect2(tmp_path, '/eye')) as bag:
        with pytest.raises(BagError, match=r'Expected camera/rgb/image_rect_color .* got .*/eye'):
            camera_remap(bag)
        remap = camera_remap(bag, {'/eye': COLOUR})
        assert remap['/eye'] == COLOUR
        with pytest.raises(BagError, match=r'expected sensor_msgs/msg/Image .* got .*CameraInfo'):
            camera_remap(bag, {'/kinect2/qhd/camera_info': COLOUR})
        with pytest.raises(BagError, match='--remap /nose: expected a topic of the bag'):
            Adaptation({'/nose': COLOUR}).topics(bag)


def test_types_of_the_same_layout_are_renamed_and_others_refused(tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add(
            Topic('/a', 'old_msgs/msg/Text', definition='string data\n', encoding='ros2msg')
        )
        writer.write(text_record('/a', BEGIN, 'hi')._replace(type='old_msgs/msg/Text'))
    with open_bag(tmp_path / 'bag') as bag:
        good = Adaptation({}, {'old_msgs/Text': 'std_msgs/String'})
        assert next(good.records(bag)) == text_record('/a', BEGIN, 'hi')
        assert good.topics(bag)[0].type == STRING
        with pytest.raises(BagError, match=r'laid out like old_msgs/msg/Text \(data\)'):
            Adaptation({}, {'old_msgs/msg/Text': 'sensor_msgs/msg/Image'}).topics(bag)


def test_a_picture_that_does_not_unpack_is_refused_with_its_topic(tmp_path: Path) -> None:
    message = jazzy().types[COMPRESSED](
        jazzy().types['std_msgs/msg/Header'](
            jazzy().types['builtin_interfaces/msg/Time'](1, 0), ''
        ),
        'jpeg',
        np.zeros(8, np.uint8),
    )
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add(Topic('/eye', COMPRESSED))
        data = bytes(jazzy().serialize_cdr(message, COMPRESSED))
        writer.write(Record('/eye', COMPRESSED, 1, data))
    with (
        open_bag(tmp_path / 'bag') as bag,
        pytest.raises(BagError, match='/eye: expected a whole PNG'),
    ):
        list(Adaptation({'/eye': COLOUR}).records(bag))
