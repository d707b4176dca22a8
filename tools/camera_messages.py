"""Messages of the cell's camera and of `heard` as records, without ROS."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from likeme_bags.camera_topics import COLOUR, DEPTH, INFO
from likeme_bags.values import Record
from likeme_core.camera_mount import CAMERA_FRAME, CameraMount
from likeme_inference.session_inputs import SessionInput
from likeme_replay.message_definitions import definitions
from likeme_replay.recorded_inputs import CAMERA_TOPICS


def time_of(stamp: int) -> Any:
    """A time message of ns."""
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return definitions().make('builtin_interfaces/msg/Time', sec=sec, nanosec=nanosec)


def header(stamp: int) -> Any:
    """A header message in the camera's frame."""
    return definitions().make('std_msgs/msg/Header', stamp=time_of(stamp), frame_id=CAMERA_FRAME)


def frame_records(
    stamp: int, rgb: NDArray[np.uint8], depth_mm: NDArray[np.uint16], camera: CameraMount
) -> tuple[Record, Record, Record]:
    """camera_info, colour (H, W, 3) and depth (H, W), mm, as the arm driver publishes them."""
    messages = {
        INFO: camera_info(stamp, camera),
        COLOUR: image(stamp, rgb, 'rgb8'),
        DEPTH: image(stamp, depth_mm, '16UC1'),
    }
    write = definitions().write
    info, colour, depth = (
        Record(topic, CAMERA_TOPICS[topic], stamp, write(message))
        for topic, message in messages.items()
    )
    return info, colour, depth


def image(stamp: int, pixels: NDArray[Any], encoding: str) -> Any:
    """An image message of (H, W[, C]) pixels."""
    return definitions().make(
        'sensor_msgs/msg/Image',
        header=header(stamp),
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=0,
        step=pixels.strides[0],
        data=np.ascontiguousarray(pixels).reshape(-1).view(np.uint8),
    )


def camera_info(stamp: int, camera: CameraMount) -> Any:
    """The true intrinsics of a rectified camera."""
    fx, fy, cx, cy = camera.fx, camera.fy, camera.cx, camera.cy
    roi = definitions().make(
        'sensor_msgs/msg/RegionOfInterest',
        x_offset=0, y_offset=0, height=0, width=0, do_rectify=False,
    )  # fmt: skip
    return definitions().make(
        'sensor_msgs/msg/CameraInfo',
        header=header(stamp),
        height=camera.height,
        width=camera.width,
        distortion_model='plumb_bob',
        d=np.zeros(5),
        k=np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1], np.float64),
        r=np.eye(3).ravel(),
        p=np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0], np.float64),
        binning_x=0,
        binning_y=0,
        roi=roi,
    )


def heard(item: SessionInput, number: int) -> bytes:
    """The CDR bytes of likeme_msgs/Heard for an input; `events` is not known here, and 0."""
    fields = item.message
    definitions().load('likeme_msgs/msg/Heard')
    message = definitions().make(
        'likeme_msgs/msg/Heard',
        header=header(item.stamp),
        kind=int(item.kind),
        number=number,
        events=0,
        refused=False,
        motion_outcome=getattr(fields, 'motion_outcome', 255),
        finished=getattr(fields, 'finished', time_of(0)),
        answer=getattr(fields, 'answer', 0),
        object=getattr(fields, 'object', ''),
        goal=getattr(fields, 'goal', ''),
        message=getattr(fields, 'message', ''),
    )
    return definitions().write(message)
