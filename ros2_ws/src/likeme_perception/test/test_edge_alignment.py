"""Shifts of an image, told by the edges of a still scene."""

from __future__ import annotations

from dataclasses import replace

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


@pytest.mark.parametrize('edges', [colours, depths])
@pytest.mark.parametrize(('columns', 'rows'), [(5, 0), (-4, 3), (0, 6)])
def test_a_shift_is_told(renderer, lemon, forearm, edges, columns, rows) -> None:
    first = alignment(renderer.frame(), edges)
    frame = renderer.frame(lemon(0.45, 0.1), forearm(0.5, -0.1, 0.1))
    assert first.distinct
    assert first.shift(edges(frame)) is None
    told = first.shift(edges(shifted(columns, rows)(frame)))
    assert told == pytest.approx((rows, columns), abs=1)


def test_no_edges_tell_nothing(renderer) -> None:
    frame = renderer.frame()
    plain = replace(frame, rgb=np.full_like(frame.rgb, 120))
    assert not alignment(plain, colours).distinct
    assert alignment(frame, colours).shift(colours(plain)) is None


def test_stripes_do_not_tell_their_shift(renderer) -> None:
    frame = renderer.frame()
    stripes = np.where(np.arange(320) % 4 < 2, 200, 60).astype(np.uint8)
    striped = replace(frame, rgb=np.broadcast_to(stripes[None, :, None], frame.rgb.shape).copy())
    assert alignment(striped, colours).shift(colours(shifted(2)(striped))) is None


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        (shifted(5), CAMERA_MOVED),
        (shifted(5, depth=False), CAMERA_MOVED),
        (shifted(5, rgb=False), NOT_REGISTERED),
    ],
)
def test_states_are_unknown_where_images_have_shifted(
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
