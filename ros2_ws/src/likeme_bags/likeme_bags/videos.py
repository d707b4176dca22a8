"""Pictures into MP4: colour as it is, depth in false colours."""

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
    if image.encoding == 'mono8':
        return np.repeat(image.pixels[:, :, None], 3, axis=2)
    metres = image.pixels * np.float32(0.001) if image.encoding == '16UC1' else image.pixels
    there = np.isfinite(metres) & (metres > 0)
    far = np.clip((np.where(there, metres, _FAR) - _NEAR) / (_FAR - _NEAR), 0, 1)
    bgr = cv2.applyColorMap((255 * (1 - far)).astype(np.uint8), cv2.COLORMAP_JET)
    bgr[~there] = 0
    return np.ascontiguousarray(bgr[:, :, ::-1])


class Video:
    """An MP4 file (MPEG-4 part 2, what OpenCV's wheels can write); a context manager.

    All pictures have the size of the first.
    """

    def __init__(self, path: Path, fps: float) -> None:
        self.path = path
        self.frames = 0
        self.shape: tuple[int, int] = (0, 0)
        self._fps = fps
        self._writer: Any = None

    def write(self, rgb: NDArray[np.uint8]) -> None:
        """Add a picture, (H, W, 3).

        Raises:
            BagError: it has another size than the first, or the file cannot be written.
        """
        size = rgb.shape[0], rgb.shape[1]
        if self._writer is None:
            self.shape = size
            code = cv2.VideoWriter.fourcc(*'mp4v')
            self._writer = cv2.VideoWriter(str(self.path), code, self._fps, size[::-1])
            if not self._writer.isOpened():
                raise BagError(f'Cannot write {self.path}.')
        if size != self.shape:
            raise BagError(f'Expected pictures of {self.shape}, got {size} for {self.path.name}.')
        self._writer.write(np.ascontiguousarray(rgb[:, :, ::-1]))
        self.frames += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._writer is not None:
            self._writer.release()
