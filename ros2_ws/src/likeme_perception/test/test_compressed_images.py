"""Compressed images: what image_transport's plugins send comes out as the raw images do."""

from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest

from likeme_perception.compressed_images import decode_compressed_depth, decode_compressed_rgb
from likeme_perception.errors import EncodingError


def png(image: np.ndarray) -> bytes:
    return bytes(cv2.imencode('.png', image)[1].tobytes())


def test_colour_is_in_rgb_order() -> None:
    rgb = np.zeros((16, 24, 3), np.uint8)
    rgb[:, :, 0], rgb[:, 12:, 2] = 200, 100
    decoded = decode_compressed_rgb(png(rgb[:, :, ::-1]))
    np.testing.assert_array_equal(decoded, rgb)


def test_depth_of_millimetres() -> None:
    depth = np.full((16, 24), 1234, np.uint16)
    depth[3] = 0
    decoded = decode_compressed_depth(bytes(12) + png(depth), '16UC1; compressedDepth png')
    assert decoded[0, 0] == pytest.approx(1.234)
    assert np.isnan(decoded[3]).all()


def test_depth_of_metres_is_packed_as_its_inverse() -> None:
    a, b = 10400.0, -103.0
    metres = np.linspace(0.5, 4, 16 * 24, dtype=np.float32).reshape(16, 24)
    packed = np.round(a / metres + b).astype(np.uint16)
    packed[3] = 0
    data = struct.pack('<iff', 0, a, b) + png(packed)
    decoded = decode_compressed_depth(data, '32FC1; compressedDepth png')
    assert np.isnan(decoded[3]).all()
    np.testing.assert_allclose(np.delete(decoded, 3, 0), np.delete(metres, 3, 0), atol=1e-3)


@pytest.mark.parametrize('data', [b'', b'RVL', bytes(12), bytes(12) + b'RVL' * 9])
def test_what_is_no_image_is_refused(data: bytes) -> None:
    with pytest.raises(EncodingError, match='Expected a JPEG or PNG image, got'):
        decode_compressed_depth(data, '16UC1; compressedDepth rvl')
    with pytest.raises(EncodingError, match='Expected a JPEG or PNG image, got'):
        decode_compressed_rgb(data)


def test_eight_bits_are_no_depth() -> None:
    with pytest.raises(EncodingError, match='Expected depth as 16-bit PNG, got uint8'):
        decode_compressed_depth(bytes(12) + png(np.zeros((16, 24), np.uint8)), '16UC1')
