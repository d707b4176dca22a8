"""Images into MP4: colour as it is, depth in false colours."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_bags.errors import BagError
from likeme_bags.images import DecodedImage

# What false colours span, m: a tabletop before a Kinect.
_NEAR, _FAR = 0.4, 2.0


def as_rgb(image: DecodedImage) -> NDArray[np.uint8]:
    """(H, W, 3) uint8 for people to look at; depth from near (red) to far (blue), none black."""
    if image.encoding == 'rgb8':
        return np.asarray(image.pixels, np.uint8)
    if image.encoding in ('mono8', 'mono16'):
        grey = image.pixels if image.encoding == 'mono8' else image.pixels >> 8
        return np.repeat(grey.astype(np.uint8)[:, :, None], 3, axis=2)
    metres = image.pixels * np.float32(0.001) if image.encoding == '16UC1' else image.pixels
    there = np.isfinite(metres) & (metres > 0)
    far = np.clip((np.where(there, metres, _FAR) - _NEAR) / (_FAR - _NEAR), 0, 1)
    bgr = cv2.applyColorMap((255 * (1 - far)).astype(np.uint8), cv2.COLORMAP_JET)
    bgr[~there] = 0
    return np.ascontiguousarray(bgr[:, :, ::-1])


class Video:
    """An MP4 file (MPEG-4 part 2, what OpenCV's wheels can write); a context manager.

    All images have the size of the first. MPEG-4 takes even sizes only: the last row or column of
    an odd one is repeated.
    """

    def __init__(self, path: Path, fps: float) -> None:
        self.path = path
        # Height and width of the frames in the file.
        self.shape: tuple[int, int] = (0, 0)
        self._source: tuple[int, int] = (0, 0)
        self._fps = fps
        self._writer: Any = None

    def write(self, rgb: NDArray[np.uint8]) -> None:
        """Add an image, (H, W, 3).

        Raises:
            BagError: it has another size than the first, or the file cannot be written.
        """
        height, width = rgb.shape[:2]
        if self._writer is None:
            self._source, self.shape = (height, width), (height + height % 2, width + width % 2)
            code = cv2.VideoWriter.fourcc(*'mp4v')
            self._writer = cv2.VideoWriter(str(self.path), code, self._fps, self.shape[::-1])
            if not self._writer.isOpened():
                raise BagError(
                    f'Cannot write {self.path}: {width}x{height} pixels at {self._fps:.5g} Hz.'
                )
        if (height, width) != self._source:
            raise BagError(
                f'Expected images of {self._source}, got {(height, width)} for {self.path.name}.'
            )
        bgr = rgb[:, :, ::-1]
        if (height, width) != self.shape:
            bgr = np.pad(bgr, ((0, height % 2), (0, width % 2), (0, 0)), 'edge')
        self._writer.write(np.ascontiguousarray(bgr))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._writer is not None:
            self._writer.release()
