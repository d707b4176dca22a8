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
    """Draws and publishes a frame: colour, depth and the camera info of each with one stamp.

    Attributes:
        frames: number of frames published.
    """

    def __init__(self, node: Node, cell: Cell) -> None:
        qos = QoSProfile(depth=5)
        self._cell, self.frames = cell, 0
        self._rgb = node.create_publisher(Image, 'camera/rgb/image_rect_color', qos)
        self._depth = node.create_publisher(Image, 'camera/depth_registered/image_rect', qos)
        self._info = node.create_publisher(CameraInfo, 'camera/rgb/camera_info', qos)
        self._depth_info = node.create_publisher(
            CameraInfo, 'camera/depth_registered/camera_info', qos
        )
        self._info_message = messages.camera_info_message(cell.world.camera)

    def publish(self, stamp: Time) -> None:
        """Publish the present frame, if anybody subscribes."""
        publishers = (self._info, self._depth_info, self._rgb, self._depth)
        if not any(publisher.get_subscription_count() for publisher in publishers):
            return
        images = self._cell.frame()
        rgb = messages.image_message(images.rgb, 'rgb8')
        depth = messages.image_message(images.depth_mm, '16UC1')
        # Depth is registered: both have the same camera.
        sent = (self._info_message, self._info_message, rgb, depth)
        for publisher, message in zip(publishers, sent, strict=True):
            message.header.stamp = stamp
            message.header.frame_id = CAMERA_FRAME
            publisher.publish(message)
        self.frames += 1
