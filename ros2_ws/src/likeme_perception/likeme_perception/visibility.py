"""Whether a blob shows all of an object, so that its extents are the object's."""

from __future__ import annotations

import cv2
import numpy as np

from likeme_perception.blobs import Blob, rows_and_columns
from likeme_perception.rgbd import RgbdFrame

# What is nearer than a blob by this much, m, within so many pixels of it may hide a part of it, if
# it is that on so large a share of the blob's rim.
_NEARER, _RIM, _RIM_SHARE = 0.02, 7, 0.04
# What is higher than an object that stands on its end, and has its lowest points above this share
# of its height, is in the air.
_LOWEST_SHARE = 0.5
# Beyond any depth, m.
_FAR = 1e3


def stands_on_table(blob: Blob, fallen_depth: float, longest: float) -> bool:
    """Whether the blob's height over the table is its own: it is neither in the air nor below.

    longest: greatest extent, m, of the objects that it may be.
    """
    z = np.sort(blob.xyz[2, :: max(1, len(blob.pixels) // 300)])
    low, high = z[len(z) // 20], z[-1 - len(z) // 100]
    if low < -fallen_depth:
        return False
    return bool(low < _LOWEST_SHARE * high or high < longest)


def partly_hidden(blob: Blob, frame: RgbdFrame) -> bool:
    """Whether something nearer to the camera, or the image's border, cuts a blob off."""
    height, width = frame.depth.shape
    rows, columns = rows_and_columns(blob.pixels, width)
    top, left = int(rows.min()) - _RIM, int(columns.min()) - _RIM
    bottom, right = int(rows.max()) + _RIM + 1, int(columns.max()) + _RIM + 1
    if min(top, left) < -_RIM + 1 or bottom > height + _RIM - 1 or right > width + _RIM - 1:
        return True
    top, left = max(top, 0), max(left, 0)
    around = frame.depth[top:bottom, left:right]
    own = np.full(around.shape, _FAR, np.float32)
    own[rows - top, columns - left] = frame.depth.take(blob.pixels)
    window = np.ones((2 * _RIM + 1, 2 * _RIM + 1), np.uint8)
    nearest = cv2.erode(own, window, borderType=cv2.BORDER_REPLICATE)
    rim = (own == _FAR) & (nearest < _FAR)
    # A comparison with NaN is False.
    nearer = np.count_nonzero(around[rim] < nearest[rim] - _NEARER)
    return bool(nearer > _RIM_SHARE * np.count_nonzero(rim))
