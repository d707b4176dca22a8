"""Shifts and turns of an image, told by the edges of a still scene."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from likeme_core.paper_world import LEFT, RIGHT
from likeme_perception.edge_alignment import EdgeAlignment, colour_edges, depth_edges
from likeme_perception.table_check import CAMERA_MOVED, NOT_REGISTERED


def alignment(frame, edges) -> EdgeAlignment:
    return EdgeAlignment(edges(frame), np.ones(frame.depth.shape, bool))


def colours(frame):
    return colour_edges(frame.rgb)


def depths(frame):
    return depth_edges(frame.depth)


def shifted(columns: int, rows: int = 0, rgb: bool = True, depth: bool = True):
    """Shifts the colours and the depth of a frame, or one of them."""

    def change(frame):
        by = {'shift': (rows, columns), 'axis': (0, 1)}
        return replace(
            frame,
            rgb=np.roll(frame.rgb, **by) if rgb else frame.rgb,
            depth=np.roll(frame.depth, **by) if depth else frame.depth,
        )

    return change


def turned(degrees: float):
    """Turns the colours and the depth of a frame about the middle of the image."""

    def change(frame):
        height, width = frame.depth.shape
        turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), degrees, 1.0)
        warped = [
            cv2.warpAffine(image, turn, (width, height), flags=cv2.INTER_NEAREST)
            for image in (frame.rgb, frame.depth)
        ]
        return replace(frame, rgb=warped[0], depth=warped[1])

    return change


@pytest.mark.parametrize('edges', [colours, depths])
@pytest.mark.parametrize(
    'change', [shifted(5), shifted(-4, 3), shifted(0, 6), turned(3), turned(-3)]
)
def test_what_moves_an_image_is_told(renderer, lemon, forearm, edges, change) -> None:
    first = alignment(renderer.frame(), edges)
    frame = renderer.frame(lemon(0.45, 0.1), forearm(0.5, -0.1, 0.1))
    assert first.distinct
    assert not first.moved(edges(frame))
    assert first.moved(edges(change(frame)))


def test_no_edges_tell_nothing(renderer) -> None:
    frame = renderer.frame()
    plain = replace(frame, rgb=np.full_like(frame.rgb, 120))
    assert not alignment(plain, colours).distinct
    assert not alignment(frame, colours).moved(colours(plain))


def test_stripes_do_not_tell_that_they_moved(renderer) -> None:
    frame = renderer.frame()
    stripes = np.where(np.arange(320) % 4 < 2, 200, 60).astype(np.uint8)
    striped = replace(frame, rgb=np.broadcast_to(stripes[None, :, None], frame.rgb.shape).copy())
    assert not alignment(striped, colours).moved(colours(shifted(2)(striped)))


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        (shifted(5), CAMERA_MOVED),
        (shifted(5, depth=False), CAMERA_MOVED),
        (shifted(5, rgb=False), NOT_REGISTERED),
        (turned(2), CAMERA_MOVED),
    ],
)
def test_states_are_unknown_where_images_have_moved(
    renderer, catalogue, lemon, pear, change, reason
) -> None:
    perception = renderer.perception(catalogue)
    things = lemon(0.45, 0.15), pear(0.40, -0.2)
    for _ in range(8):
        seen = perception.process(renderer.frame(*things))
    assert [o.state for o in seen.objects] == [LEFT, RIGHT]
    for _ in range(12):
        seen = perception.process(change(renderer.frame(*things)))
    assert (seen.reason, [o.state for o in seen.objects]) == (reason, [None, None])
    for _ in range(12):
        seen = perception.process(renderer.frame(*things))
    # A camera that was moved and put back is not known to be where it was.
    assert seen.reason == (reason if reason == CAMERA_MOVED else '')
