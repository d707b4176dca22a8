"""The way from camera messages to TabletopPerception, shared by the node and by replays.

Messages are read by their fields alone: rclpy's and rosbags' both serve.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2

from likeme_core.stamps import stamp_ns
from likeme_perception.compressed_images import decode_compressed_depth, decode_compressed_rgb
from likeme_perception.errors import FrameError, NoDepthError
from likeme_perception.node_settings import NodeSettings
from likeme_perception.observation import TableObservation
from likeme_perception.pairing import StampOrder
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import (
    ImageB,
    ImageF,
    Intrinsics,
    RgbdFrame,
    decode_depth,
    decode_rgb,
)


@dataclass(frozen=True, eq=False)
class FrameResult:
    """What became of one frame: `frame` and `table`, or why it was rejected.

    Attributes:
        reason: short name of the rejection's class, for counters; empty when the frame was read.
        sentence: the rejection with expected and got.
        restarted: stamps went back, so that tracking began anew with this frame.
        background_learned: this frame completed the background.
    """

    frame: RgbdFrame | None = None
    table: TableObservation | None = None
    reason: str = ''
    sentence: str = ''
    restarted: bool = False
    background_learned: bool = False


#: Reason and sentence for a frame whose stamp does not follow the one before.
_OUT_OF_ORDER = {
    'older': (
        'older than the last',
        'Expected stamps to increase, got a frame older than the one before it.',
    ),
    'ahead': (
        'far ahead of the last',
        'Expected stamps to go on, got a frame from the future of the one before it.',
    ),
}


class FrameReader:
    """Decodes paired images in the order of their stamps and runs perception on them.

    Attributes:
        intrinsics: of the camera_info that counts; None before the first.
        perception: None until a frame could be decoded after a start or a change of camera.
    """

    def __init__(self, settings: NodeSettings, intrinsics: Intrinsics | None = None) -> None:
        self.settings = settings
        self.intrinsics = intrinsics
        self.perception: TabletopPerception | None = None
        self._order = StampOrder()
        self._info_error = ''

    @property
    def background_learned(self) -> bool:
        """Whether table states come of the frames."""
        return self.perception is not None and self.perception.background is not None

    @property
    def reason(self) -> str:
        """Why the last frame that was read told nothing; empty if it did."""
        return '' if self.perception is None else self.perception.reason

    def set_camera_info(self, info: Any) -> bool:
        """Use a CameraInfo from now on; whether it differs from the last, which restarts all.

        Raises:
            ValueError: it is unusable; the last usable one stays in force.
        """
        try:
            intrinsics = intrinsics_of(info)
        except ValueError as error:
            self._info_error = str(error)
            raise
        changed = self.intrinsics is not None and intrinsics != self.intrinsics
        if intrinsics != self.intrinsics:
            self.intrinsics, self.perception = intrinsics, None
        return changed

    def read(self, colour: Any, depth: Any) -> FrameResult:
        """Read a pair of Image messages."""
        order = self._order.classify(stamp_ns(depth.header.stamp))
        if order in _OUT_OF_ORDER:
            reason, sentence = _OUT_OF_ORDER[order]
            return FrameResult(reason=reason, sentence=sentence)
        restarted = order == 'restart' and self.perception is not None
        if restarted and self.perception is not None:
            self.perception.reset_tracking()
        if self.intrinsics is None:
            return FrameResult(reason='no camera_info', sentence=self._no_camera_info())
        learned_before = self.background_learned
        try:
            frame = decode_frame(colour, depth)
            table = self._process(frame, self.intrinsics)
        except (ValueError, cv2.error) as error:
            reason = getattr(error, 'reason', FrameError.reason)
            return FrameResult(reason=reason, sentence=str(error), restarted=restarted)
        return FrameResult(
            frame, table, restarted=restarted,
            background_learned=table.learned and not learned_before,
        )  # fmt: skip

    def _process(self, frame: RgbdFrame, intrinsics: Intrinsics) -> TableObservation:
        if not frame.has_depth:
            raise NoDepthError(f'Expected depth readings, got 0 of {frame.depth.size}.')
        if self.perception is None:
            config, catalogue, _ = self.settings
            self.perception = TabletopPerception(config, intrinsics, catalogue)
        return self.perception.process(frame)

    def _no_camera_info(self) -> str:
        if self._info_error:
            return f'camera_info is unusable: {self._info_error}'
        return 'no camera_info has come yet'


def decode_frame(colour: Any, depth: Any) -> RgbdFrame:
    """The frame in a pair of Image or CompressedImage messages, with the depth image's stamp.

    Raises:
        ValueError: an encoding is not known, or sizes do not fit.
    """
    return RgbdFrame(
        stamp_ns(depth.header.stamp), depth.header.frame_id, colour_of(colour), depth_of(depth)
    )


def colour_of(image: Any) -> ImageB:
    """Colour (H, W, 3) in RGB order of an Image or CompressedImage message.

    Raises:
        ValueError: the encoding is not known, or the data does not fit the size.
    """
    if hasattr(image, 'format'):
        return decode_compressed_rgb(image.data)
    return decode_rgb(image.data, image.encoding, image.height, image.width, image.step)


def depth_of(image: Any) -> ImageF:
    """Depth (H, W), m, NaN = no reading, of an Image or CompressedImage message.

    Raises:
        ValueError: the encoding is not known, or the data does not fit the size.
    """
    if hasattr(image, 'format'):
        return decode_compressed_depth(image.data, image.format)
    return decode_depth(
        image.data, image.encoding, image.height, image.width, image.step, bool(image.is_bigendian)
    )


def intrinsics_of(info: Any) -> Intrinsics:
    """Intrinsics of a rectified camera, from P, or from K where P is not filled in.

    Raises:
        ValueError: focal lengths or size make no sense.
    """
    p, k = info.p, info.k
    lens = (p[0], p[5], p[2], p[6]) if p[0] > 0 else (k[0], k[4], k[2], k[5])
    fx, fy, cx, cy = map(float, lens)
    return Intrinsics(fx, fy, cx, cy, int(info.width), int(info.height))
