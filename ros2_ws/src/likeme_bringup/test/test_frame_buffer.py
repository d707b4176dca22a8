"""Frames in bounded memory."""

from __future__ import annotations

import pytest

from likeme_bringup.frame_buffer import MAX_FRAMES, FrameBuffer


@pytest.mark.parametrize('count', [1, 5, MAX_FRAMES, 10 * MAX_FRAMES, 1000 * MAX_FRAMES])
def test_the_middle_frame_is_kept_in_bounded_memory(count: int) -> None:
    frames = FrameBuffer[int]()
    for number in range(count):
        frames.add(number)
        assert len(frames) <= MAX_FRAMES
    assert frames.middle() == pytest.approx(count / 2, abs=max(0.5, count / 30))


def test_clear_drops_all_frames() -> None:
    frames = FrameBuffer[int]()
    for number in range(10 * MAX_FRAMES):
        frames.add(number)
    frames.clear()
    assert len(frames) == 0
    frames.add(7)
    assert frames.middle() == 7
