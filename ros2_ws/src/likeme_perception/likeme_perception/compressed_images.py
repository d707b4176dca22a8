"""Colour and depth from compressed images, as image_transport's plugins send them."""

from __future__ import annotations

import struct
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.errors import EncodingError
from likeme_perception.rgbd import Bytes, ImageB, ImageF, depth_in_metres

# compressedDepth: an int and two floats, A and B, before the PNG. Of 32FC1 the PNG holds
# A / metres + B.
_DEPTH_HEADER = struct.Struct('<iff')


def decode_compressed_rgb(data: Bytes) -> ImageB:
    """Colour as (H, W, 3) uint8 in RGB order, from JPEG or PNG.

    Raises:
        EncodingError: it is neither, or damaged.
    """
    return np.asarray(cv2.cvtColor(_decoded(data, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB), np.uint8)


def decode_compressed_depth(data: Bytes, encoding: str) -> ImageF:
    """Depth in m, (H, W) float32, NaN = no reading, from compressedDepth.

    encoding: what the message calls format, e.g. "16UC1; compressedDepth png".

    Raises:
        EncodingError: it is no 16-bit PNG (but RVL, say), or damaged.
    """
    image = np.frombuffer(data, np.uint8)
    raw = _decoded(image[_DEPTH_HEADER.size :], cv2.IMREAD_UNCHANGED)
    if raw.dtype != np.uint16 or raw.ndim != 2:
        raise EncodingError(f'Expected depth as 16-bit PNG, got {raw.dtype} of {raw.shape}.')
    if not encoding.startswith('32FC1'):
        return depth_in_metres(raw)
    _, a, b = _DEPTH_HEADER.unpack(image[: _DEPTH_HEADER.size].tobytes())
    with np.errstate(divide='ignore'):
        return depth_in_metres(np.where(raw > 0, np.float32(a) / (raw - np.float32(b)), np.nan))


def _decoded(data: Bytes, flags: int) -> NDArray[Any]:
    image = None
    if len(data):
        image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    if image is None:
        raise EncodingError(f'Expected a JPEG or PNG image, got {len(data)} other bytes.')
    return np.asarray(image)
