"""Pictures in records: raw Image, and the CompressedImage of the usual image transports."""

from __future__ import annotations

import re
import struct
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_bags.errors import LIBRARY_ERRORS, BagError
from likeme_bags.image_size import claimed_size
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record

IMAGE = 'sensor_msgs/msg/Image'
COMPRESSED = 'sensor_msgs/msg/CompressedImage'
_MAX_PIXELS = 2**26
# What compressed_depth_image_transport puts before the PNG: a format number and two floats.
_DEPTH_HEADER = struct.Struct('<iff')
_RAW: dict[str, tuple[str, int]] = {
    'rgb8': ('u1', 3),
    'bgr8': ('u1', 3),
    '8UC3': ('u1', 3),
    'rgba8': ('u1', 4),
    'bgra8': ('u1', 4),
    'mono8': ('u1', 1),
    '8UC1': ('u1', 1),
    'mono16': ('u2', 1),
    '16UC1': ('u2', 1),
    '32FC1': ('f4', 1),
}
# OpenCV names a pattern by its second row: ROS's RGGB is its BG.
_BAYER = {
    'bayer_rggb8': cv2.COLOR_BayerBG2RGB,
    'bayer_grbg8': cv2.COLOR_BayerGB2RGB,
    'bayer_gbrg8': cv2.COLOR_BayerGR2RGB,
    'bayer_bggr8': cv2.COLOR_BayerRG2RGB,
}


class DecodedImage(NamedTuple):
    """A picture."""

    # The header's: ns, and whose optical frame.
    stamp: int
    frame_id: str
    # 'rgb8', 'mono8', '16UC1' (depth in mm, 0: none) or '32FC1' (depth in m, NaN: none).
    encoding: str
    # (H, W, 3) uint8 or (H, W) uint8, uint16, float32.
    pixels: NDArray[Any]


def decode_image(record: Record) -> DecodedImage:
    """The picture in a record of Image or CompressedImage.

    Raises:
        BagError: with the topic, what was found and what was expected.
    """
    if record.type not in (IMAGE, COMPRESSED):
        raise BagError(f'{record.topic}: expected an image, got {record.type}.')
    try:
        message: Any = jazzy().deserialize_cdr(memoryview(record.data), record.type)
        encoding, pixels = (_raw if record.type == IMAGE else _compressed)(message)
    except BagError as error:
        raise BagError(f'{record.topic}: {error}') from None
    except (*LIBRARY_ERRORS, MemoryError, cv2.error) as error:
        why = ' '.join(str(error).split())[:160]
        raise BagError(
            f'{record.topic}: expected {record.type}, got bytes that are none: {why}'
        ) from None
    header = message.header
    stamp = header.stamp.sec * 10**9 + header.stamp.nanosec
    return DecodedImage(stamp, header.frame_id, encoding, pixels)


def _raw(message: Any) -> tuple[str, NDArray[Any]]:
    """Pixels of sensor_msgs/Image."""
    encoding = message.encoding
    kind, channels = ('u1', 1) if encoding in _BAYER else _RAW.get(encoding, ('', 0))
    if not kind:
        known = ', '.join([*_RAW, *_BAYER])
        raise BagError(f"expected an encoding of {known}, got '{encoding[:20]}'.")
    dtype = np.dtype(('>' if message.is_bigendian else '<') + kind)
    row = message.width * channels * dtype.itemsize
    step, height = message.step or row, message.height
    if step < row or len(message.data) < step * height:
        raise BagError(
            f'expected {height} rows of {row} bytes, got rows of {step} and '
            f'{len(message.data)} bytes in all.'
        )
    rows = message.data[: step * height].reshape(height, step)[:, :row]
    pixels = np.ascontiguousarray(rows).view(dtype).astype(dtype.newbyteorder('='), copy=False)
    if encoding in _BAYER:
        return 'rgb8', cv2.cvtColor(pixels, _BAYER[encoding])
    if channels == 1:
        return {'u1': 'mono8', 'u2': '16UC1', 'f4': '32FC1'}[kind], pixels
    pixels = pixels.reshape(height, message.width, channels)
    # Plain 8UC3 is what OpenCV users publish: blue first.
    return 'rgb8', _rgb(pixels, blue_first=encoding in ('bgr8', 'bgra8', '8UC3'))


def _rgb(pixels: NDArray[Any], blue_first: bool) -> NDArray[Any]:
    order = slice(2, None, -1) if blue_first else slice(0, 3)
    return np.ascontiguousarray(pixels[:, :, order])


def _compressed(message: Any) -> tuple[str, NDArray[Any]]:
    """Pixels of sensor_msgs/CompressedImage, by its `format`."""
    data: NDArray[np.uint8] = message.data
    if 'compressedDepth' in message.format:
        return _compressed_depth(message.format, data)
    image = _decoded(data)
    if image.ndim == 3:
        return 'rgb8', _rgb(image, blue_first=True)
    if image.dtype == np.uint16:
        return '16UC1', image
    return 'mono8', image


def _compressed_depth(form: str, data: NDArray[np.uint8]) -> tuple[str, NDArray[Any]]:
    """Depth behind its header of 12 bytes; 32FC1 is stored as inverse depth, quantised.

    depth = A / (q - B), q = 0: no reading (compressed_depth_image_transport).
    """
    encoding = re.split('[; ]', form, maxsplit=1)[0]
    if 'rvl' in form.lower() or encoding not in ('16UC1', '32FC1'):
        raise BagError(f"expected depth as PNG of 16UC1 or 32FC1, got '{form[:40]}'.")
    if len(data) < _DEPTH_HEADER.size:
        raise BagError(f'expected a header of 12 bytes before the depth, got {len(data)} bytes.')
    _, a, b = _DEPTH_HEADER.unpack(data[: _DEPTH_HEADER.size].tobytes())
    quantised = _decoded(data[_DEPTH_HEADER.size :])
    if quantised.ndim != 2 or quantised.dtype != np.uint16:
        raise BagError(f'expected 16-bit depth, got {quantised.dtype} of {quantised.shape}.')
    if encoding == '16UC1':
        return encoding, quantised
    with np.errstate(divide='ignore', invalid='ignore'):
        depth = np.float32(a) / (quantised.astype(np.float32) - np.float32(b))
    depth[(quantised == 0) | ~np.isfinite(depth)] = np.nan
    return encoding, depth


def _decoded(data: NDArray[np.uint8]) -> NDArray[Any]:
    """A PNG or JPEG as OpenCV has it: blue first."""
    height, width = claimed_size(data.tobytes() if len(data) < 2**16 else data[: 2**16].tobytes())
    if not 0 < height * width <= _MAX_PIXELS:
        raise BagError(f'expected at most {_MAX_PIXELS} pixels, got {height}x{width}.')
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        raise BagError(f'expected a whole PNG or JPEG of {height}x{width}, got a damaged one.')
    return image


def image_record(topic: str, stamp: int, image: DecodedImage) -> Record:
    """A raw Image record of a picture; stamp: log time, ns."""
    store = jazzy()
    types = store.types
    header = types['std_msgs/msg/Header'](
        types['builtin_interfaces/msg/Time'](*divmod(image.stamp, 10**9)), image.frame_id
    )
    height, width = image.pixels.shape[:2]
    flat = np.ascontiguousarray(image.pixels).view(np.uint8).reshape(-1)
    message = types[IMAGE](header, height, width, image.encoding, 0, flat.size // height, flat)
    return Record(topic, IMAGE, stamp, bytes(store.serialize_cdr(message, IMAGE)))
