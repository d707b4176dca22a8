"""From messages to perception, with messages of no particular library."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from likeme_core.paper_world import WORLD
from likeme_core.settings import defaults
from likeme_perception.frame_reader import FrameReader, intrinsics_of
from likeme_perception.node_settings import read_settings, settings_of

MS = 1_000_000
FOCAL_LENGTH = 262.5


def header(stamp: int) -> Any:
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec), frame_id='camera')


def image(pixels: np.ndarray, encoding: str, stamp: int) -> Any:
    return SimpleNamespace(
        header=header(stamp), height=pixels.shape[0], width=pixels.shape[1], encoding=encoding,
        is_bigendian=0, step=pixels[0].nbytes, data=pixels.tobytes(),
    )  # fmt: skip


def camera_info(focal_length: float = FOCAL_LENGTH) -> Any:
    k = [focal_length, 0.0, 159.5, 0.0, focal_length, 119.5, 0.0, 0.0, 1.0]
    return SimpleNamespace(header=header(0), height=240, width=320, k=k, p=[0.0] * 12)


def reader() -> FrameReader:
    values = defaults(settings_of(WORLD)) | {'background_frames': 3}
    return FrameReader(read_settings(values, WORLD))


def frames(renderer: Any, *stamps: int) -> list[tuple[Any, Any]]:
    """Pairs of messages of the renderer's empty table."""
    made = []
    for stamp in stamps:
        frame = renderer.frame()
        mm = np.nan_to_num(frame.depth * 1000).astype(np.uint16)
        made.append((image(frame.rgb, 'rgb8', stamp), image(mm, '16UC1', stamp)))
    return made


def test_frames_are_read_once_camera_info_is_known(renderer: Any) -> None:
    read = reader()
    stamps = [k * 100 * MS for k in range(1, 6)]
    first, *others = frames(renderer, *stamps)
    assert read.read(*first).sentence == 'no camera_info has come yet'
    assert not read.set_camera_info(camera_info())
    results = [read.read(*pair) for pair in others]
    assert [r.reason for r in results] == [''] * 4
    assert [r.background_learned for r in results] == [False, False, True, False]
    assert [r.table.learned for r in results if r.table] == [False, False, True, True]


def test_what_cannot_be_read_has_a_reason_and_a_sentence(renderer: Any) -> None:
    read = reader()
    read.set_camera_info(camera_info())
    (colour, depth), (_, late), (_, other) = frames(renderer, 200 * MS, 100 * MS, 300 * MS)
    assert read.read(colour, depth).reason == ''
    assert read.read(colour, late).reason == 'older than the last'
    colour.encoding = 'yuv422_yuy2'
    result = read.read(colour, other)
    assert result.reason == 'encoding'
    assert "got 'yuv422_yuy2'" in result.sentence


def test_an_unusable_camera_info_is_named_in_the_rejection(renderer: Any) -> None:
    read = reader()
    with pytest.raises(ValueError, match='focal lengths above 0, got 0'):
        read.set_camera_info(camera_info(0.0))
    (pair,) = frames(renderer, 100 * MS)
    result = read.read(*pair)
    assert result.reason == 'no camera_info'
    assert 'focal lengths above 0, got 0' in result.sentence


def test_a_changed_camera_info_restarts_perception_and_an_unusable_one_does_not(
    renderer: Any,
) -> None:
    read = reader()
    read.set_camera_info(camera_info())
    for pair in frames(renderer, *(k * 100 * MS for k in range(1, 4))):
        read.read(*pair)
    assert read.background_learned
    assert not read.set_camera_info(camera_info())
    with pytest.raises(ValueError, match='focal'):
        read.set_camera_info(camera_info(-1.0))
    assert read.background_learned
    assert read.set_camera_info(camera_info(FOCAL_LENGTH + 1e-9))
    assert not read.background_learned


def test_stamps_that_start_again_restart_tracking_alone(renderer: Any) -> None:
    read = reader()
    read.set_camera_info(camera_info())
    stamps = [9000 * MS, 9100 * MS, 9200 * MS, 100 * MS, 200 * MS]
    results = [read.read(*pair) for pair in frames(renderer, *stamps)]
    assert [r.restarted for r in results] == [False] * 4 + [True]
    assert results[3].reason == 'older than the last'
    assert read.background_learned


def test_intrinsics_come_of_p_or_else_of_k() -> None:
    info = camera_info()
    assert intrinsics_of(info).fx == FOCAL_LENGTH
    info.p = [500.0, 0.0, 1.0, 0.0, 0.0, 501.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    found = intrinsics_of(info)
    assert (found.fx, found.fy, found.cx, found.cy) == (500.0, 501.0, 1.0, 2.0)
