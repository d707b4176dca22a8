"""Publishes the frames of the simulated Kinect."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from likeme_arm_sim import messages
from likeme_arm_sim.cell import Cell
from likeme_arm_sim.kinect import RgbdImages
from likeme_core.camera_mount import CAMERA_FRAME


class CameraPublisher:
    """Draws and publishes a frame: colour, depth and the camera info of each with one stamp.

    Colour and depth also compressed, by the names of image_transport, while somebody subscribes.

    Attributes:
        frames: number of frames published.
    """

    def __init__(self, node: Node, cell: Cell) -> None:
        qos = QoSProfile(depth=5)
        colour, depth = 'camera/rgb', 'camera/depth_registered'
        self._cell, self.frames = cell, 0
        info = messages.camera_info_message(cell.world.camera)
        # Depth is registered: both have the same camera, and their info goes first.
        self._topics: tuple[tuple[Publisher, Callable[[RgbdImages], Any]], ...] = tuple(
            (node.create_publisher(kind, topic, qos), message)
            for kind, topic, message in (
                (CameraInfo, f'{colour}/camera_info', lambda _: info),
                (CameraInfo, f'{depth}/camera_info', lambda _: info),
                (Image, f'{colour}/image_rect_color',
                 lambda i: messages.image_message(i.rgb, 'rgb8')),
                (Image, f'{depth}/image_rect',
                 lambda i: messages.image_message(i.depth_mm, '16UC1')),
                (CompressedImage, f'{colour}/image_rect_color/compressed',
                 lambda i: messages.compressed_colour(i.rgb)),
                (CompressedImage, f'{depth}/image_rect/compressedDepth',
                 lambda i: messages.compressed_depth(i.depth_mm)),
            )
        )  # fmt: skip

    def publish(self, stamp: Time) -> None:
        """Publish the present frame to whoever subscribes."""
        wanted = [topic for topic in self._topics if topic[0].get_subscription_count()]
        if not wanted:
            return
        images = self._cell.frame()
        for publisher, message_of in wanted:
            message = message_of(images)
            message.header.stamp = stamp
            message.header.frame_id = CAMERA_FRAME
            publisher.publish(message)
        self.frames += 1
