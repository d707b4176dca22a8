"""Pictures come out as they went in, whatever transport they took."""

from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from sample_bags import text_record

from likeme_bags.errors import BagError, UnsupportedError
from likeme_bags.images import COMPRESSED, IMAGE, DecodedImage, decode_image, image_record
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record
from likeme_bags.videos import as_rgb

RNG = np.random.default_rng(3)
COLOUR = RNG.integers(0, 256, (24, 32, 3), np.uint8)
DEPTH = RNG.integers(0, 4000, (24, 32), np.uint16)


def header() -> object:
    types = jazzy().types
    return types['std_msgs/msg/Header'](types['builtin_interfaces/msg/Time'](3, 5), 'optical')


def raw(encoding: str, data: bytes, step: int, width: int = 32, big: int = 0) -> Record:
    pixels = np.frombuffer(data, np.uint8)
    message = jazzy().types[IMAGE](header(), 24, width, encoding, big, step, pixels)
    return Record('/camera', IMAGE, 9, bytes(jazzy().serialize_cdr(message, IMAGE)))


def compressed(form: str, data: bytes) -> Record:
    message = jazzy().types[COMPRESSED](header(), form, np.frombuffer(data, np.uint8))
    return Record('/camera/c', COMPRESSED, 9, bytes(jazzy().serialize_cdr(message, COMPRESSED)))


def png(image: NDArray[np.generic]) -> bytes:
    return bytes(cv2.imencode('.png', image)[1])


def test_raw_encodings() -> None:
    wide = np.concatenate([COLOUR, np.full((24, 32, 1), 255, np.uint8)], axis=2)
    cases = {
        'rgb8': (COLOUR, 'rgb8', COLOUR),
        'bgr8': (COLOUR[:, :, ::-1], 'rgb8', COLOUR),
        'rgba8': (wide, 'rgb8', COLOUR),
        'mono8': (COLOUR[:, :, 0], 'mono8', COLOUR[:, :, 0]),
        '16UC1': (DEPTH, '16UC1', DEPTH),
        'mono16': (DEPTH, 'mono16', DEPTH),
        '32FC1': (DEPTH.astype(np.float32), '32FC1', DEPTH.astype(np.float32)),
    }
    for encoding, (pixels, name, expected) in cases.items():
        pixels = np.ascontiguousarray(pixels)
        image = decode_image(raw(encoding, pixels.tobytes(), pixels.strides[0]))
        assert (image.stamp, image.frame_id, image.encoding) == (3 * 10**9 + 5, 'optical', name)
        np.testing.assert_array_equal(image.pixels, expected)


WIDE = COLOUR.astype(np.uint16) * 257
WIDE_ALPHA = np.concatenate([WIDE, np.full((24, 32, 1), 65535, np.uint16)], axis=2)


def blue_first(pixels: NDArray[np.generic]) -> NDArray[np.generic]:
    return np.ascontiguousarray(pixels[..., [2, 1, 0, 3][: pixels.shape[2]]])


@pytest.mark.parametrize('big', [0, 1])
@pytest.mark.parametrize(
    ('encoding', 'pixels'),
    [
        ('rgb16', WIDE),
        ('bgr16', blue_first(WIDE)),
        ('16UC3', blue_first(WIDE)),
        ('rgba16', WIDE_ALPHA),
        ('bgra16', blue_first(WIDE_ALPHA)),
        ('16UC4', blue_first(WIDE_ALPHA)),
    ],
)
def test_colour_of_16_bits_becomes_8(encoding: str, pixels: NDArray[np.uint16], big: int) -> None:
    data = pixels.astype('>u2' if big else '<u2').tobytes()
    image = decode_image(raw(encoding, data, pixels.strides[0], big=big))
    assert (image.encoding, image.pixels.dtype) == ('rgb8', np.uint8)
    np.testing.assert_array_equal(image.pixels, COLOUR)


@pytest.mark.parametrize('ending', ['.png', '.tiff'])
def test_compressed_images_of_16_bits(ending: str) -> None:
    def encoded(form: str, pixels: NDArray[np.generic]) -> Record:
        return compressed(form, bytes(cv2.imencode(ending, pixels)[1]))

    for pixels in (WIDE, WIDE_ALPHA, COLOUR):
        image = decode_image(encoded('rgb16; png compressed bgr16', blue_first(pixels)))
        assert (image.encoding, image.pixels.dtype) == ('rgb8', np.uint8)
        np.testing.assert_array_equal(image.pixels, COLOUR)
    for form, expected in (('16UC1; tiff', '16UC1'), ('mono16; tiff', 'mono16')):
        image = decode_image(encoded(form, DEPTH))
        assert image.encoding == expected
        np.testing.assert_array_equal(image.pixels, DEPTH)


def test_grey_of_16_bits_is_grey_in_a_video() -> None:
    image = decode_image(raw('mono16', np.full((24, 32), 200 * 256, np.uint16).tobytes(), 64))
    np.testing.assert_array_equal(as_rgb(image), np.full((24, 32, 3), 200, np.uint8))


def test_yuv_of_two_bytes_a_pixel() -> None:
    """A surface of luma 200 with strong red; the two differ in the order of bytes alone."""
    uyvy = np.tile(np.array([100, 120, 200, 120], np.uint8), (24, 16))
    for encoding, data in (('yuv422', uyvy), ('uyvy', uyvy),
                           ('yuv422_yuy2', uyvy.reshape(24, -1, 2)[:, :, ::-1]),
                           ('yuyv', uyvy.reshape(24, -1, 2)[:, :, ::-1])):  # fmt: skip
        image = decode_image(raw(encoding, data.tobytes(), 64))
        assert (image.encoding, image.pixels.shape) == ('rgb8', (24, 32, 3))
        red, green, blue = image.pixels[5, 5].astype(int)
        # BT.601: Y = 120, U = 100, V = 200.
        assert np.abs([red - 236, green - 73, blue - 65]).max() <= 2


def test_padded_rows_and_big_endian() -> None:
    padded = np.zeros((24, 40), np.uint16)
    padded[:, :32] = DEPTH
    image = decode_image(raw('16UC1', padded.astype('>u2').tobytes(), 80, big=1))
    np.testing.assert_array_equal(image.pixels, DEPTH)


def test_bayer_has_its_colours_in_the_right_place() -> None:
    """A red surface, as a sensor with red in the corner sees it."""
    mosaic = np.zeros((24, 32), np.uint8)
    mosaic[::2, ::2] = 200
    image = decode_image(raw('bayer_rggb8', mosaic.tobytes(), 32))
    assert image.encoding == 'rgb8'
    np.testing.assert_array_equal(image.pixels[8, 8], (200, 0, 0))


def test_bayer_of_16_bits_and_compressed() -> None:
    mosaic = np.zeros((24, 32), np.uint16)
    mosaic[::2, ::2] = 200 * 256
    eight = (mosaic >> 8).astype(np.uint8)
    for record in (
        raw('bayer_rggb16', mosaic.tobytes(), 64),
        compressed('bayer_rggb16; png compressed ', png(mosaic)),
        compressed('bayer_rggb8; png compressed ', png(eight)),
    ):
        image = decode_image(record)
        assert (image.encoding, image.pixels.dtype) == ('rgb8', np.uint8)
        np.testing.assert_array_equal(image.pixels[8, 8], (200, 0, 0))


def test_compressed_colour() -> None:
    bgr = np.ascontiguousarray(COLOUR[:, :, ::-1])
    image = decode_image(compressed('rgb8; png compressed bgr8', png(bgr)))
    np.testing.assert_array_equal(image.pixels, COLOUR)
    smooth = np.full((24, 32, 3), (200, 60, 20), np.uint8)
    jpeg = bytes(cv2.imencode('.jpg', np.ascontiguousarray(smooth[:, :, ::-1]))[1])
    seen = decode_image(compressed('jpeg', jpeg)).pixels.astype(int)
    assert np.abs(seen - smooth).max() <= 3


def test_compressed_depth() -> None:
    head = struct.pack('<iff', 0, 0.0, 0.0)
    for form in ('16UC1; compressedDepth', '16UC1; compressedDepth png'):
        image = decode_image(compressed(form, head + png(DEPTH)))
        assert image.encoding == '16UC1'
        np.testing.assert_array_equal(image.pixels, DEPTH)
    plain = decode_image(compressed('16UC1; png compressed', png(DEPTH)))
    np.testing.assert_array_equal(plain.pixels, DEPTH)


def test_quantised_float_depth() -> None:
    """As compressed_depth_image_transport does it: q = A / depth + B, q = 0 for no reading."""
    depth = RNG.uniform(0.5, 4.0, (24, 32)).astype(np.float32)
    depth[3, 4] = np.nan
    quantisation, far = 100.0, 10.0
    a = quantisation * (quantisation + 1)
    b = 1 - a / far
    q = np.where(np.isfinite(depth), a / depth + b, 0).astype(np.uint16)
    record = compressed('32FC1; compressedDepth', struct.pack('<iff', 0, a, b) + png(q))
    image = decode_image(record)
    assert image.encoding == '32FC1'
    assert np.isnan(image.pixels[3, 4])
    there = np.isfinite(depth)
    # One step of the quantisation at 4 m.
    assert np.abs(image.pixels[there] - depth[there]).max() < 4.0**2 / a * 1.1


def test_a_record_of_a_picture_decodes_to_it() -> None:
    for pixels, encoding in ((COLOUR, 'rgb8'), (DEPTH, '16UC1')):
        image = DecodedImage(12345, 'cam', encoding, pixels)
        again = decode_image(image_record('/x', 5, image))
        assert again[:3] == image[:3]
        np.testing.assert_array_equal(again.pixels, pixels)


@pytest.mark.parametrize(
    'record',
    [
        raw('nv21', bytes(24 * 96), 96),
        raw('32FC3', bytes(24 * 384), 384),
        compressed('h264', b'\0\0\0\1gB'),
        compressed('jxl', b'\xff\x0a' + bytes(20)),
        compressed('16UC1; compressedDepth rvl', bytes(50)),
        compressed('tiff', bytes(cv2.imencode('.tiff', DEPTH.astype(np.int32))[1])),
    ],
)
def test_formats_that_are_right_but_not_decoded(record: Record) -> None:
    with pytest.raises(UnsupportedError, match=r'^/camera.*expected .* got'):
        decode_image(record)


def huge_tiff() -> bytes:
    """A TIFF that claims 60000 x 60000 pixels in 38 bytes."""
    entries = b''.join(struct.pack('<HHII', tag, 4, 1, 60000) for tag in (256, 257))
    return b'II*\0' + struct.pack('<IH', 8, 2) + entries + bytes(4)


def huge_png(side: int) -> bytes:
    """A PNG that claims `side` x `side` pixels in 80 bytes."""
    body = struct.pack('>IIBBBBB', side, side, 8, 2, 0, 0, 0)
    parts = [(b'IHDR', body), (b'IDAT', zlib.compress(b'x')), (b'IEND', b'')]
    return b'\x89PNG\r\n\x1a\n' + b''.join(
        struct.pack('>I', len(data)) + name + data + struct.pack('>I', zlib.crc32(name + data))
        for name, data in parts
    )


REFUSED = {
    'another type': (lambda: text_record('/a', 1, 'x'), 'expected an image, got std_msgs'),
    'an unknown encoding': (lambda: raw('nv12', bytes(24 * 64), 64), "got 'nv12'"),
    'too few bytes': (lambda: raw('rgb8', bytes(100), 96), '100 bytes in all'),
    'a step below the width': (lambda: raw('rgb8', bytes(24 * 96), 10), 'rows of 10'),
    'too wide for its data': (lambda: raw('rgb8', bytes(96), 96, width=2**31), 'got rows of 96'),
    'no picture': (lambda: compressed('jpeg', b'hello'), 'expected a whole PNG, JPEG or TIFF'),
    'a cut picture': (
        lambda: compressed('png', png(COLOUR)[:200]),
        'expected a whole PNG, JPEG or TIFF',
    ),
    'a bomb': (lambda: compressed('png', huge_png(60000)), '3600000000 pixels'),
    'a smaller bomb': (lambda: compressed('png', huge_png(9000)), 'pixels, got 9000x9000'),
    'a cut JPEG': (
        lambda: compressed('jpeg', bytes(cv2.imencode('.jpg', COLOUR)[1])[:-300]),
        'truncated',
    ),
    'a bomb in TIFF': (
        lambda: compressed('tiff', huge_tiff()),
        'expected a whole PNG, JPEG or TIFF',
    ),
    'a cut TIFF': (
        lambda: compressed('tiff', bytes(cv2.imencode('.tiff', COLOUR)[1])[:100]),
        'expected a whole PNG, JPEG or TIFF',
    ),
    'no pixels': (lambda: raw('rgb8', b'', 0, width=0), 'expected an image, got one of 24x0'),
    'RVL': (lambda: compressed('16UC1; compressedDepth rvl', bytes(50)), 'depth as PNG'),
    'depth without its header': (
        lambda: compressed('16UC1; compressedDepth', bytes(3)),
        'header of 12 bytes',
    ),
    'a cut message': (
        lambda: raw('16UC1', DEPTH.tobytes(), 64)._replace(data=b'\0\1\0\0abc'),
        'bytes that are none',
    ),
}


@pytest.mark.parametrize('name', REFUSED)
def test_refusals_name_topic_found_and_expected(name: str) -> None:
    make, sentence = REFUSED[name]
    with pytest.raises(BagError, match=sentence) as raised:
        decode_image(make())
    assert str(raised.value).startswith('/')
