"""Node that keeps the latest frames of a camera."""

from __future__ import annotations

from collections import deque
from copy import copy
from typing import Any

import cv2
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from likeme_bags.camera_topics import COLOUR, DEPTH, INFO
from likeme_core.ros.qos import CAMERA
from likeme_core.stamps import stamp_ns
from likeme_perception.frame_reader import decode_frame, intrinsics_of
from likeme_perception.pairing import StampPairing
from likeme_perception.rgbd import Intrinsics, RgbdFrame
from likeme_replay.ros.waiting_node import WaitingNode


class FramesNode(WaitingNode):
    """Keeps the latest frames.

    Subscribes: camera/rgb/image_rect_color, camera/depth_registered/image_rect, or as compressed
    images on .../compressed and .../compressedDepth; camera/rgb/camera_info.

    Attributes:
        frames: the latest, oldest first.
        intrinsics: of the latest camera_info; None before it.
        heard: names of the topics that were received.
    """

    def __init__(self, keep: int, **options: Any) -> None:
        super().__init__('frames', **options)
        self.frames: deque[RgbdFrame] = deque(maxlen=keep)
        self.intrinsics: Intrinsics | None = None
        self.heard: set[str] = set()
        self._raw: set[int] = set()
        self._pairing: StampPairing[Any] = StampPairing(
            0.016, lambda image: stamp_ns(image.header.stamp)
        )
        for kind, topic, receive in (
            (Image, COLOUR, lambda m: self._on_image(0, m)),
            (Image, DEPTH, lambda m: self._on_image(1, m)),
            (CompressedImage, f'{COLOUR}/compressed', lambda m: self._on_compressed(0, m)),
            (CompressedImage, f'{DEPTH}/compressedDepth', lambda m: self._on_compressed(1, m)),
            (CameraInfo, INFO, self._on_info),
        ):
            self.create_subscription(kind, topic, receive, copy(CAMERA))

    @property
    def missing(self) -> str:
        """What has not been received, for a person."""
        names = [topic for topic in (COLOUR, DEPTH, INFO) if topic not in self.heard]
        return ', '.join(names) or 'nothing, but no colour and depth of one stamp'

    def _on_image(self, stream: int, image: Image) -> None:
        self._raw.add(stream)
        self._add(stream, image)

    def _on_compressed(self, stream: int, image: CompressedImage) -> None:
        # A camera that sends both sends each frame twice.
        if stream not in self._raw:
            self._add(stream, image)

    def _add(self, stream: int, image: Image | CompressedImage) -> None:
        self.heard.add((COLOUR, DEPTH)[stream])
        pair = self._pairing.add(stream, image)
        if pair is not None:
            try:
                self.frames.append(decode_frame(*pair))
            except (ValueError, cv2.error):
                return

    def _on_info(self, info: CameraInfo) -> None:
        self.heard.add(INFO)
        try:
            self.intrinsics = intrinsics_of(info)
        except ValueError:
            return
