"""Scattered pixels without depth, as on dark cloth, filled from their neighbours."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from likeme_perception.rgbd import RgbdFrame

# Share of single missing pixels from which they are filled. A Kinect's frame has 0.006 at most,
# and opening the foreground mask loses objects from about 0.1 on.
_LEAST_SHARE = 0.03
# Every so manieth row is counted.
_ROWS = 8
# Least number of neighbours with a reading, and their greatest spread (m) on one surface.
_LEAST_NEIGHBOURS, _ONE_SURFACE = 3, 0.02
_FAR = np.float32(1e3)


def with_holes_filled(frame: RgbdFrame) -> RgbdFrame:
    """The frame, each missing pixel with the mean depth of its 8 neighbours if many are missing.

    Across an edge it gets the nearer surface's depth.
    """
    missing = np.isnan(frame.depth[::_ROWS])
    single = missing[:, 1:-1] & ~missing[:, :-2] & ~missing[:, 2:]
    if float(single.mean()) < _LEAST_SHARE:
        return frame
    read = np.isfinite(frame.depth)
    total = cv2.boxFilter(np.where(read, frame.depth, np.float32(0)), -1, (3, 3), normalize=False)
    count = cv2.boxFilter(read.astype(np.float32), -1, (3, 3), normalize=False)
    cross = np.ones((3, 3), np.uint8)
    near = cv2.erode(np.where(read, frame.depth, _FAR), cross)
    far = cv2.dilate(np.where(read, frame.depth, -_FAR), cross)
    value = np.where(far - near < _ONE_SURFACE, total / np.maximum(count, 1), near)
    filled = np.where(read | (count < _LEAST_NEIGHBOURS), frame.depth, value)
    return replace(frame, depth=filled.astype(np.float32))
