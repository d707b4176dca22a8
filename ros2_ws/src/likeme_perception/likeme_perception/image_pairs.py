"""Pairs of image files: a colour image, and 16-bit depth in mm registered to it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from likeme_perception.rgbd import Intrinsics, RgbdFrame, depth_in_metres
from likeme_perception.typed_values import json_mapping, number, read_text, require

#: How the names of the two images of a pair end.
COLOUR_END, DEPTH_END = '_color.png', '_depth.png'
#: File in a folder of pairs with fx, fy, cx, cy of their camera.
INTRINSICS_FILE = 'intrinsics.json'


class ImagePair(NamedTuple):
    """The files of one frame, and their name without _color.png."""

    name: str
    colour: Path
    depth: Path


def find_pairs(paths: Sequence[Path]) -> list[ImagePair]:
    """The pairs in a folder, or those of files that take turns: COLOUR DEPTH COLOUR DEPTH.

    Raises:
        ValueError: there are none, or one lacks its depth.
    """
    if len(paths) == 1 and paths[0].is_dir():
        return _pairs_in(paths[0])
    if not paths or len(paths) % 2:
        raise ValueError(f'Expected pairs COLOUR DEPTH of images, got {len(paths)} files.')
    return [
        ImagePair(colour.stem.removesuffix('_color'), colour, depth)
        for colour, depth in zip(paths[::2], paths[1::2], strict=True)
    ]


def _pairs_in(folder: Path) -> list[ImagePair]:
    pairs = []
    for colour in sorted(folder.glob(f'*{COLOUR_END}')):
        name = colour.name.removesuffix(COLOUR_END)
        pairs.append(ImagePair(name, colour, folder / f'{name}{DEPTH_END}'))
        if not pairs[-1].depth.is_file():
            raise ValueError(f'Expected {pairs[-1].depth} beside {colour.name}, got no such file.')
    if not pairs:
        raise ValueError(
            f'Expected images NAME{COLOUR_END} and NAME{DEPTH_END} in {folder}, got none.'
        )
    return pairs


def read_frame(colour: Path, depth: Path) -> RgbdFrame:
    """A frame from a colour image and a 16-bit depth image in mm.

    Raises:
        ValueError: one is no such image, or their sizes differ.
    """
    bgr = _image(colour, cv2.IMREAD_COLOR)
    raw = _image(depth, cv2.IMREAD_UNCHANGED)
    if raw.ndim != 2 or raw.dtype != np.uint16:
        raise ValueError(
            f'Expected 16-bit depth of one channel, got {raw.dtype} {raw.shape} in {depth}.'
        )
    rgb = np.ascontiguousarray(bgr[:, :, ::-1], np.uint8)
    return RgbdFrame(0, str(colour), rgb, depth_in_metres(raw))


def _image(path: Path, flags: int) -> NDArray[Any]:
    try:
        image = cv2.imread(str(path), flags)
    except cv2.error:
        # Of a size that OpenCV refuses.
        image = None
    if image is None:
        raise ValueError(f'Expected an image, got {path}.')
    return image


def write_frame(folder: Path, name: str, frame: RgbdFrame) -> None:
    """Write a frame as a pair of images; depth in whole mm, 0 without a reading.

    Raises:
        OSError: it cannot be written.
    """
    write_image(folder / f'{name}{COLOUR_END}', frame.rgb)
    millimetres = np.rint(np.nan_to_num(frame.depth) * 1000).clip(0, 65535).astype(np.uint16)
    _write(folder / f'{name}{DEPTH_END}', millimetres)


def check_image_name(path: Path) -> None:
    """Refuse a place where no image can be written, before the work.

    Raises:
        ValueError: no such folder, or an ending that stands for no image format.
    """
    if path.is_dir() or not path.parent.is_dir():
        got = 'a folder' if path.is_dir() else f'no folder {path.parent}'
        raise ValueError(f'Expected {path} to be a file in a folder, got {got}.')
    if not path.suffix or not cv2.haveImageWriter(str(path)):
        raise ValueError(f'Expected an image format like .png or .jpg, got {path.name!r}.')


def write_image(path: Path, rgb: NDArray[np.uint8]) -> None:
    """Write an image; check_image_name has been asked.

    Raises:
        OSError: it cannot be written.
    """
    _write(path, rgb[:, :, ::-1])


def _write(path: Path, image: NDArray[Any]) -> None:
    path.touch()
    if not cv2.imwrite(str(path), image):
        raise OSError(f'Expected {path} to be written, got nothing: is the disk full?')


def intrinsics_file(paths: Sequence[Path]) -> Path | None:
    """The intrinsics.json in a folder of pairs; None: there is none, or files were named."""
    if len(paths) == 1 and (paths[0] / INTRINSICS_FILE).is_file():
        return paths[0] / INTRINSICS_FILE
    return None


def read_intrinsics(path: Path | None, shape: tuple[int, ...]) -> Intrinsics:
    """Intrinsics from JSON with fx, fy, cx, cy; None: a Kinect's, scaled to the image."""
    if path is None:
        scale = shape[1] / 640
        return Intrinsics(
            525 * scale, 525 * scale, (shape[1] - 1) / 2, (shape[0] - 1) / 2, shape[1], shape[0]
        )
    names = ('fx', 'fy', 'cx', 'cy')
    values = require(str(path), set(names), json_mapping(read_text(path), path))
    fx, fy, cx, cy = (number(f'{name} in {path}', values[name]) for name in names)
    if not np.isfinite((fx, fy, cx, cy)).all():
        raise ValueError(f'Expected a finite camera in {path}, got {fx:g} {fy:g} {cx:g} {cy:g}.')
    return Intrinsics(fx, fy, cx, cy, shape[1], shape[0])


def write_intrinsics(folder: Path, camera: Intrinsics) -> None:
    """Write the intrinsics.json of a folder of pairs."""
    values = {name: getattr(camera, name) for name in ('fx', 'fy', 'cx', 'cy')}
    (folder / INTRINSICS_FILE).write_text(f'{json.dumps(values)}\n', encoding='utf-8')
