"""Publishes the frames of the simulated Kinect."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, Image

from likeme_arm_sim import messages
from likeme_arm_sim.cell import Cell
from likeme_core.camera_mount import CAMERA_FRAME


class CameraPublisher:
    """Draws and publishes a frame: colour, depth and camera info with one stamp.

    Attributes:
        frames: number of frames published.
    """

    def __init__(self, node: Node, cell: Cell) -> None:
        qos = QoSProfile(depth=5)
        self._cell, self.frames = cell, 0
        self._rgb = node.create_publisher(Image, 'camera/rgb/image_rect_color', qos)
        self._depth = node.create_publisher(Image, 'camera/depth_registered/image_rect', qos)
        self._info = node.create_publisher(CameraInfo, 'camera/rgb/camera_info', qos)
        self._info_message = messages.camera_info_message(cell.world.camera)

    def publish(self, stamp: Time) -> None:
        """Publish the present frame, if anybody subscribes."""
        publishers = (self._info, self._rgb, self._depth)
        if not any(publisher.get_subscription_count() for publisher in publishers):
            return
        images = self._cell.frame()
        rgb = messages.image_message(images.rgb, 'rgb8')
        depth = messages.image_message(images.depth_mm, '16UC1')
        for publisher, message in zip(publishers, (self._info_message, rgb, depth), strict=True):
            message.header.stamp = stamp
            message.header.frame_id = CAMERA_FRAME
            publisher.publish(message)
        self.frames += 1
