"""RGB-D frames: decoding of image buffers, camera intrinsics, depth noise model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from likeme_perception.errors import EncodingError

Bytes = bytes | bytearray | memoryview | NDArray[np.uint8]
ImageF = NDArray[np.float32]
ImageB = NDArray[np.uint8]

_DEPTH_TYPES = {'16UC1': 'u2', 'mono16': 'u2', '32FC1': 'f4'}
_COLOUR_CHANNELS = {'rgb8': 3, 'bgr8': 3, 'rgba8': 4, 'bgra8': 4}


@dataclass(frozen=True)
class Intrinsics:
    """Pinhole model of a rectified camera, pixels."""

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        if not (self.fx > 0 and self.fy > 0):
            raise ValueError(f'Expected focal lengths above 0, got {self.fx:g} and {self.fy:g}.')
        if self.width < 8 or self.height < 8:
            raise ValueError(f'Expected an image of 8x8 or more, got {self.height}x{self.width}.')

    @property
    def shape(self) -> tuple[int, int]:
        """Image size (rows, columns)."""
        return self.height, self.width


@dataclass(frozen=True)
class RgbdFrame:
    """A registered pair of a colour and a depth image, rectified and of the same size.

    stamp: ns. rgb: (H, W, 3) uint8. depth: (H, W) float32 along the optical axis, m, NaN = no
    reading.
    """

    stamp: int
    frame_id: str
    rgb: ImageB
    depth: ImageF

    def __post_init__(self) -> None:
        if self.rgb.ndim != 3 or self.rgb.shape[2] != 3:
            raise ValueError(f'Expected colour of shape (H, W, 3), got {self.rgb.shape}.')
        if self.depth.ndim != 2 or self.rgb.shape[:2] != self.depth.shape:
            raise ValueError(f'Expected depth of {_size(self.rgb)}, got {_size(self.depth)}.')

    @property
    def has_depth(self) -> bool:
        """Whether any pixel has a reading."""
        return bool(np.isfinite(self.depth).any())


def _size(image: NDArray[np.generic]) -> str:
    return 'x'.join(str(n) for n in image.shape[:2])


def _rows(data: Bytes, height: int, row_bytes: int, step: int) -> ImageB:
    """The image's bytes without row padding, shape (height, row_bytes)."""
    step = step or row_bytes
    if step < row_bytes:
        raise ValueError(f'Expected a row step of at least {row_bytes} bytes, got {step}.')
    flat = np.frombuffer(data, np.uint8)
    if flat.size < step * height:
        raise ValueError(f'Expected {step * height} bytes of image data, got {flat.size}.')
    return flat[: step * height].reshape(height, step)[:, :row_bytes]


def decode_depth(
    data: Bytes, encoding: str, height: int, width: int, step: int = 0, bigendian: bool = False
) -> ImageF:
    """Depth in m, float32, NaN = no reading, from 16UC1 (mm, 0 = none) or 32FC1 (m)."""
    if encoding not in _DEPTH_TYPES:
        raise EncodingError(f'Expected depth as 16UC1 or 32FC1, got {encoding!r}.')
    kind = np.dtype(('>' if bigendian else '<') + _DEPTH_TYPES[encoding])
    raw = np.ascontiguousarray(_rows(data, height, width * kind.itemsize, step)).view(kind)
    return depth_in_metres(raw)


def depth_in_metres(raw: NDArray[np.generic]) -> ImageF:
    """Float32 m with NaN for no reading, from integer mm or float m."""
    if raw.dtype.kind in 'ui':
        depth = np.multiply(raw, np.float32(0.001), dtype=np.float32)
    else:
        depth = raw.astype(np.float32)
        depth[~np.isfinite(depth)] = np.nan
    depth[depth <= 0] = np.nan
    return np.asarray(depth, np.float32)


def decode_rgb(data: Bytes, encoding: str, height: int, width: int, step: int = 0) -> ImageB:
    """Colour as (H, W, 3) uint8 in RGB order, from rgb8, bgr8, rgba8 or bgra8."""
    if encoding not in _COLOUR_CHANNELS:
        raise EncodingError(f'Expected colour as rgb8 or bgr8, got {encoding!r}.')
    channels = _COLOUR_CHANNELS[encoding]
    image = _rows(data, height, width * channels, step).reshape(height, width, channels)
    order = slice(2, None, -1) if encoding.startswith('bgr') else slice(0, 3)
    return np.ascontiguousarray(image[:, :, order])


@lru_cache(maxsize=4)
def rays(intrinsics: Intrinsics) -> ImageF:
    """Viewing rays (x/z, y/z, 1) of every pixel in the optical frame, (H, W, 3), read-only."""
    u = (np.arange(intrinsics.width, dtype=np.float32) - intrinsics.cx) / intrinsics.fx
    v = (np.arange(intrinsics.height, dtype=np.float32) - intrinsics.cy) / intrinsics.fy
    grid = np.ones((*intrinsics.shape, 3), np.float32)
    grid[:, :, 0], grid[:, :, 1] = u[None, :], v[:, None]
    grid.setflags(write=False)
    return grid


def deproject(depth: ImageF, intrinsics: Intrinsics) -> ImageF:
    """Points in the optical frame, m, (H, W, 3); NaN where there is no reading."""
    if depth.shape != intrinsics.shape:
        raise ValueError(
            f'Expected depth of {intrinsics.height}x{intrinsics.width}, got {_size(depth)}.'
        )
    return np.asarray(rays(intrinsics) * depth[:, :, None], np.float32)


def depth_sigma(z: ImageF) -> ImageF:
    """Axial noise of a Kinect at depth z, m: 0.0012 + 0.0019 (z - 0.4)^2 (Nguyen et al. 2012)."""
    return (np.float32(0.0012) + np.float32(0.0019) * (z - np.float32(0.4)) ** 2).astype(
        np.float32
    )
