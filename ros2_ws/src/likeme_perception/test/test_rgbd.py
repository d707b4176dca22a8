"""Decoding of images, and RGB-D frames."""

from __future__ import annotations

from array import array

import numpy as np
import pytest

from likeme_perception.rgbd import (
    Intrinsics,
    RgbdFrame,
    decode_depth,
    decode_rgb,
    deproject,
    depth_sigma,
    rays,
)

MM = np.array([[1000, 0, 1500], [2500, 65535, 1]], np.uint16)
METRES = np.array([[1.0, np.nan, 1.5], [2.5, 65.535, 0.001]], np.float32)


def test_millimetres_become_metres_and_zero_becomes_nan() -> None:
    depth = decode_depth(MM.tobytes(), '16UC1', 2, 3)
    np.testing.assert_allclose(depth, METRES, rtol=1e-6)
    assert depth.dtype == np.float32


def test_bigendian_and_padded_rows_are_read_alike() -> None:
    padded = np.zeros((2, 5), '>u2')
    padded[:, :3] = MM
    depth = decode_depth(array('B', padded.tobytes()), '16UC1', 2, 3, step=10, bigendian=True)
    np.testing.assert_allclose(depth, METRES, rtol=1e-6)


def test_float_depth_keeps_positive_finite_values_only() -> None:
    raw = np.array([[1.0, np.inf, -1.0], [0.0, np.nan, 2.0]], np.float32)
    depth = decode_depth(raw.tobytes(), '32FC1', 2, 3)
    np.testing.assert_array_equal(depth, [[1.0, np.nan, np.nan], [np.nan, np.nan, 2.0]])


@pytest.mark.parametrize(
    ('encoding', 'channels'), [('rgb8', 3), ('bgr8', 3), ('rgba8', 4), ('bgra8', 4)]
)
def test_colour_comes_out_as_rgb(encoding: str, channels: int) -> None:
    pixel = {'rgb8': (1, 2, 3), 'bgr8': (3, 2, 1), 'rgba8': (1, 2, 3, 9), 'bgra8': (3, 2, 1, 9)}
    raw = np.tile(np.array(pixel[encoding], np.uint8), (2, 2, 1))
    rgb = decode_rgb(raw.tobytes(), encoding, 2, 2, step=2 * channels)
    assert rgb[0, 0].tolist() == [1, 2, 3]


def test_wrong_encodings_and_sizes_are_refused() -> None:
    with pytest.raises(ValueError, match="16UC1 or 32FC1, got '8UC1'"):
        decode_depth(MM.tobytes(), '8UC1', 2, 3)
    with pytest.raises(ValueError, match="rgb8 or bgr8, got 'mono8'"):
        decode_rgb(MM.tobytes(), 'mono8', 2, 3)
    with pytest.raises(ValueError, match='Expected 24 bytes of image data, got 12'):
        decode_depth(MM.tobytes(), '16UC1', 4, 3)
    with pytest.raises(ValueError, match='row step of at least 6 bytes, got 4'):
        decode_depth(MM.tobytes(), '16UC1', 2, 3, step=4)
    with pytest.raises(ValueError, match='Expected depth of 4x6, got 2x3'):
        RgbdFrame(0, '', np.zeros((4, 6, 3), np.uint8), METRES)


def test_a_frame_without_readings_has_no_depth() -> None:
    rgb = np.zeros((2, 3, 3), np.uint8)
    assert RgbdFrame(0, '', rgb, METRES).has_depth
    assert not RgbdFrame(0, '', rgb, np.full((2, 3), np.nan, np.float32)).has_depth


def test_deprojection_follows_the_pinhole_model_and_caches_its_rays() -> None:
    camera = Intrinsics(100.0, 200.0, 10.0, 5.0, 20, 10)
    points = deproject(np.full((10, 20), 2.0, np.float32), camera)
    np.testing.assert_allclose(points[5, 10], [0.0, 0.0, 2.0])
    np.testing.assert_allclose(points[7, 15], [0.1, 0.02, 2.0], rtol=1e-6)
    assert rays(camera) is rays(Intrinsics(100.0, 200.0, 10.0, 5.0, 20, 10))
    with pytest.raises(ValueError, match='Expected depth of 10x20, got 3x3'):
        deproject(np.ones((3, 3), np.float32), camera)


def test_depth_noise_is_the_published_value_of_a_kinect() -> None:
    assert depth_sigma(np.float32([1.4]))[0] == pytest.approx(0.0012 + 0.0019)


def test_intrinsics_without_focal_length_are_refused() -> None:
    with pytest.raises(ValueError, match='focal lengths above 0, got 0'):
        Intrinsics(0.0, 0.0, 0.0, 0.0, 640, 480)
