"""Node of `see --live`: receives the pictures that perception draws."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image

from likeme_core.ros.heartbeat import HEARTBEAT_QOS
from likeme_msgs.msg import Heartbeat
from likeme_perception.rgbd import decode_rgb
from likeme_replay.ros.waiting_node import WaitingNode


class OverlayNode(WaitingNode):
    """Keeps the latest picture of a running perception_node.

    Subscribes: table_overlay (sensor_msgs/Image), heartbeat.

    Attributes:
        count: pictures received.
        said: what perception_node last said it is not ready for; empty when it is ready; None: it
            was not heard.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__('see', **options)
        self.count = 0
        self.said: str | None = None
        self._image: Image | None = None
        self.create_subscription(Image, 'table_overlay', self._on_image, qos_profile_sensor_data)
        self.create_subscription(Heartbeat, 'heartbeat', self._on_heartbeat, HEARTBEAT_QOS)

    @property
    def picture(self) -> NDArray[np.uint8] | None:
        """The latest picture, (H, W, 3) RGB."""
        image = self._image
        if image is None:
            return None
        return decode_rgb(image.data, image.encoding, image.height, image.width, image.step)

    def _on_image(self, image: Image) -> None:
        self._image = image
        self.count += 1

    def _on_heartbeat(self, heartbeat: Heartbeat) -> None:
        if heartbeat.node.endswith('/perception_node'):
            self.said = heartbeat.message
