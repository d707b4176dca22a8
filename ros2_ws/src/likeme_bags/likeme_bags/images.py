"""Images in records: raw Image, and the CompressedImage of the usual image transports."""

from __future__ import annotations

import io
import re
import struct
import warnings
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from likeme_bags.errors import LIBRARY_ERRORS, BagError, UnsupportedError
from likeme_bags.text_output import one_line
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record

IMAGE = 'sensor_msgs/msg/Image'
COMPRESSED = 'sensor_msgs/msg/CompressedImage'
_MAX_PIXELS = 2**26
# What Pillow warns of is an error here, or does not matter.
warnings.filterwarnings('ignore', module='PIL')
# Pillow's names for 8 and 16 bits and float32.
_GREY_MODES = ('L', 'I;16', 'I;16B', 'I;16L', 'F')
# What compressed_depth_image_transport puts before the PNG: a format number and two floats.
_DEPTH_HEADER = struct.Struct('<iff')
# OpenCV names a pattern by its second row: ROS's RGGB is its BG.
_BAYER = {
    'bayer_rggb': cv2.COLOR_BayerBG2RGB,
    'bayer_grbg': cv2.COLOR_BayerGB2RGB,
    'bayer_gbrg': cv2.COLOR_BayerGR2RGB,
    'bayer_bggr': cv2.COLOR_BayerRG2RGB,
}
# Two pixels in four bytes.
_YUV422 = {
    'yuv422': cv2.COLOR_YUV2RGB_UYVY,
    'uyvy': cv2.COLOR_YUV2RGB_UYVY,
    'yuv422_yuy2': cv2.COLOR_YUV2RGB_YUY2,
    'yuyv': cv2.COLOR_YUV2RGB_YUY2,
}
# Type and number of the values of a pixel.
_LAYOUTS: dict[str, tuple[str, int]] = {
    **dict.fromkeys(('rgb8', 'bgr8', '8UC3'), ('u1', 3)),
    **dict.fromkeys(('rgba8', 'bgra8', '8UC4'), ('u1', 4)),
    **dict.fromkeys(('rgb16', 'bgr16', '16UC3'), ('u2', 3)),
    **dict.fromkeys(('rgba16', 'bgra16', '16UC4'), ('u2', 4)),
    **dict.fromkeys(('mono8', '8UC1', *(f'{pattern}8' for pattern in _BAYER)), ('u1', 1)),
    **dict.fromkeys(('mono16', '16UC1', *(f'{pattern}16' for pattern in _BAYER)), ('u2', 1)),
    **dict.fromkeys(_YUV422, ('u1', 2)),
    '32FC1': ('f4', 1),
}


class DecodedImage(NamedTuple):
    """An image."""

    # The header's: ns, and whose optical frame.
    stamp: int
    frame_id: str
    # 'rgb8', 'mono8', 'mono16' (grey), '16UC1' (depth in mm, 0: none) or '32FC1' (depth in m,
    # NaN: none).
    encoding: str
    # (H, W, 3) uint8 or (H, W) uint8, uint16, float32.
    pixels: NDArray[Any]


def decode_image(record: Record) -> DecodedImage:
    """The image in a record of Image or CompressedImage.

    Raises:
        UnsupportedError: the encoding or format is none of those this package decodes.
        BagError: with the topic, what was found and what was expected.
    """
    if record.type not in (IMAGE, COMPRESSED):
        raise BagError(f'{record.topic}: expected an image, got {record.type}.')
    try:
        message: Any = jazzy().deserialize_cdr(memoryview(record.data), record.type)
        encoding, pixels = (_raw if record.type == IMAGE else _compressed)(message)
    except BagError as error:
        raise type(error)(f'{record.topic}: {error}') from None
    except (*LIBRARY_ERRORS, MemoryError, cv2.error) as error:
        raise BagError(
            f'{record.topic}: expected {record.type}, got bytes that are none: '
            f'{one_line(error, 160)}'
        ) from None
    header = message.header
    stamp = header.stamp.sec * 10**9 + header.stamp.nanosec
    return DecodedImage(stamp, header.frame_id, encoding, pixels)


def _raw(message: Any) -> tuple[str, NDArray[Any]]:
    """Pixels of sensor_msgs/Image."""
    encoding = message.encoding
    if encoding not in _LAYOUTS:
        raise UnsupportedError(
            'expected an encoding as rgb8, bgra8, rgb16, mono8, mono16, 16UC1, 32FC1, '
            f"bayer_rggb8 or yuv422, got '{one_line(encoding, 20)}'."
        )
    kind, channels = _LAYOUTS[encoding]
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
    if channels > 1:
        pixels = pixels.reshape(height, message.width, channels)
    return _converted(encoding, pixels)


def _converted(encoding: str, pixels: NDArray[Any]) -> tuple[str, NDArray[Any]]:
    """Pixels of a ROS encoding as one that `DecodedImage` has."""
    if pixels.size == 0:
        raise BagError(f'expected an image, got one of {pixels.shape[0]}x{pixels.shape[1]}.')
    if encoding in _YUV422:
        return 'rgb8', cv2.cvtColor(pixels, _YUV422[encoding])
    if (pattern := encoding.rstrip('0123456789')) in _BAYER:
        return 'rgb8', _8_bit(cv2.cvtColor(pixels, _BAYER[pattern]))
    if pixels.ndim == 3:
        # Plain 8UC3 and the like is what OpenCV users publish: blue first.
        return 'rgb8', _8_bit(_rgb(pixels, blue_first=not encoding.startswith('rgb')))
    return {'8UC1': 'mono8'}.get(encoding, encoding), pixels


def _8_bit(colour: NDArray[Any]) -> NDArray[np.uint8]:
    """Colour of 8 or 16 bits a channel with 8."""
    return (colour >> 8).astype(np.uint8) if colour.dtype == np.uint16 else colour


def _rgb(pixels: NDArray[Any], blue_first: bool) -> NDArray[Any]:
    order = slice(2, None, -1) if blue_first else slice(0, 3)
    return np.ascontiguousarray(pixels[:, :, order])


def _compressed(message: Any) -> tuple[str, NDArray[Any]]:
    """Pixels of sensor_msgs/CompressedImage, by its `format`: 'ENCODING; HOW compressed ...'."""
    data: NDArray[np.uint8] = message.data
    if 'compressedDepth' in message.format:
        return _compressed_depth(message.format, data)
    image = _decoded(data, message.format)
    if image.ndim == 3:
        return 'rgb8', image
    encoding = message.format.partition(';')[0].strip()
    if encoding.rstrip('0123456789') in _BAYER:
        return _converted(encoding, image)
    if image.dtype == np.uint16:
        return 'mono16' if encoding == 'mono16' else '16UC1', image
    return 'mono8' if image.dtype == np.uint8 else '32FC1', image


def _compressed_depth(form: str, data: NDArray[np.uint8]) -> tuple[str, NDArray[Any]]:
    """Depth behind its header of 12 bytes; 32FC1 is stored as inverse depth, quantised.

    depth = A / (q - B), q = 0: no reading (compressed_depth_image_transport).
    """
    encoding = re.split('[; ]', form, maxsplit=1)[0]
    if 'rvl' in form.lower() or encoding not in ('16UC1', '32FC1'):
        raise UnsupportedError(
            f"expected depth as PNG of 16UC1 or 32FC1, got '{one_line(form, 40)}'."
        )
    if len(data) < _DEPTH_HEADER.size:
        raise BagError(f'expected a header of 12 bytes before the depth, got {len(data)} bytes.')
    _, a, b = _DEPTH_HEADER.unpack(data[: _DEPTH_HEADER.size].tobytes())
    quantised = _decoded(data[_DEPTH_HEADER.size :], 'png')
    if quantised.ndim != 2 or quantised.dtype != np.uint16:
        raise BagError(f'expected 16-bit depth, got {quantised.dtype} of {quantised.shape}.')
    if encoding == '16UC1':
        return encoding, quantised
    with np.errstate(divide='ignore', invalid='ignore'):
        depth = np.float32(a) / (quantised.astype(np.float32) - np.float32(b))
    depth[(quantised == 0) | ~np.isfinite(depth)] = np.nan
    return encoding, depth


def _decoded(data: NDArray[np.uint8], form: str) -> NDArray[Any]:
    """A PNG, JPEG or TIFF: (H, W, 3) uint8, or grey as (H, W) uint8, uint16 or float32.

    Pillow gives colour of 16 bits with 8: the upper byte.
    """
    try:
        with Image.open(io.BytesIO(data.data), formats=('PNG', 'JPEG', 'TIFF')) as image:
            if image.width * image.height > _MAX_PIXELS:
                size = f'{image.height}x{image.width}'
                raise BagError(f'expected at most {_MAX_PIXELS} pixels, got {size}.')
            # Pillow before 10.3 reads grey PNG of 16 bits as 32; PNG has no more than 16.
            if image.mode == 'I' and image.format == 'PNG':
                return np.asarray(image).astype(np.uint16)
            if image.mode == 'I':
                raise UnsupportedError('expected channels of 8 or 16 bits, got 32.')
            if image.mode not in _GREY_MODES:
                return np.asarray(image.convert('RGB'))
            pixels = np.asarray(image)
            return pixels.astype(pixels.dtype.newbyteorder('='), copy=False)
    except (*LIBRARY_ERRORS, OSError, EOFError, Image.DecompressionBombError) as error:
        if re.search('jpe?g|png|tiff?', form.lower() or 'png'):
            raise BagError(
                f'expected a whole PNG, JPEG or TIFF, got one of {len(data)} bytes that begins '
                f'with {bytes(data[:8])!r}: {one_line(error, 80)}.'
            ) from None
    raise UnsupportedError(f"expected PNG, JPEG or TIFF, got '{one_line(form, 40)}'.")


def encoding_of(record: Record) -> str:
    """The encoding of a raw Image; '' where the record is not one."""
    try:
        message: Any = jazzy().deserialize_cdr(memoryview(record.data), IMAGE)
    except (*LIBRARY_ERRORS, MemoryError):
        return ''
    return str(message.encoding)


def image_record(topic: str, stamp: int, image: DecodedImage) -> Record:
    """A raw Image record of an image; stamp: log time, ns."""
    store = jazzy()
    types = store.types
    header = types['std_msgs/msg/Header'](
        types['builtin_interfaces/msg/Time'](*divmod(image.stamp, 10**9)), image.frame_id
    )
    height, width = image.pixels.shape[:2]
    flat = np.ascontiguousarray(image.pixels).view(np.uint8).reshape(-1)
    message = types[IMAGE](header, height, width, image.encoding, 0, flat.size // height, flat)
    return Record(topic, IMAGE, stamp, bytes(store.serialize_cdr(message, IMAGE)))
