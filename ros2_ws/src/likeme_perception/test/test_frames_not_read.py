"""Frames that tell nothing: dark, without depth, from a camera that moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
from likeme_core.table import DarkPlace
from likeme_perception.camera_view import CameraView
from likeme_perception.catalogue import Catalogue
from likeme_perception.colour import ColourComponent
from likeme_perception.depth_holes import with_holes_filled
from likeme_perception.light import OVEREXPOSED, TOO_DARK
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.table_check import CAMERA_MOVED, DEPTH_MISSING


def settle(perception, renderer, *things, frames: int = 8, change=lambda frame: frame):
    """Process the same scene for some frames; the last observation."""
    for _ in range(frames):
        seen = perception.process(change(renderer.frame(*things)))
    return seen


def lit(factor: float):
    """Changes a frame's light."""
    return lambda frame: replace(frame, rgb=np.clip(frame.rgb * factor, 0, 255).astype(np.uint8))


def without_depth(share: float):
    """Takes a share of a frame's readings away."""
    rng = np.random.default_rng(1)

    def change(frame):
        lost = rng.random(frame.depth.shape) < share
        return replace(frame, depth=np.where(lost, np.nan, frame.depth).astype(np.float32))

    return change


@pytest.mark.parametrize(
    ('change', 'reason'), [(lit(0.01), TOO_DARK), (without_depth(0.999), DEPTH_MISSING)]
)
def test_an_unreadable_second_leaves_states_unknown_and_nothing_else(
    renderer, catalogue, lemon, pear, change, reason
) -> None:
    perception = renderer.perception(catalogue)
    things = lemon(0.45, 0.15), pear(0.40, -0.2)
    before = settle(perception, renderer, *things)
    dark = settle(perception, renderer, *things, frames=10, change=change)
    assert [o.state for o in before.objects] == [LEFT, RIGHT]
    assert (dark.reason, perception.reason, dark.settled) == (reason, reason, False)
    assert [o.state for o in dark.objects] == [None, None]
    assert dark.objects[0].centroid == before.objects[0].centroid
    after = settle(perception, renderer, *things)
    assert (after.reason, [o.state for o in after.objects]) == ('', [LEFT, RIGHT])


def test_no_depth_at_all_is_no_absence(renderer, catalogue, lemon) -> None:
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, 0.15))
    seen = settle(perception, renderer, lemon(0.45, 0.15), change=without_depth(1.1))
    assert (seen.object('lemon').state, seen.reason) == (None, DEPTH_MISSING)


@pytest.mark.parametrize('factor', [0.1, 0.5])
def test_objects_keep_their_names_when_the_light_changes(
    renderer, catalogue, lemon, pear, factor
) -> None:
    perception = renderer.perception(catalogue)
    things = lemon(0.45, 0.15), pear(0.40, -0.2)
    settle(perception, renderer, *things)
    seen = settle(perception, renderer, *things, change=lit(factor))
    assert [o.state for o in seen.objects] == [LEFT, RIGHT]


def test_a_colour_that_saturates_is_no_absence(renderer, catalogue, lemon, pear) -> None:
    perception = renderer.perception(catalogue)
    things = lemon(0.45, 0.15), pear(0.40, -0.2)
    settle(perception, renderer, *things)
    seen = settle(perception, renderer, *things, change=lit(1.25))
    assert [o.state for o in seen.objects] == [LEFT, RIGHT]
    moved = lemon(0.45, 0.05), things[1]
    seen = settle(perception, renderer, *moved, change=lit(1.25))
    assert [o.state for o in seen.objects] == [None, RIGHT]


def test_objects_keep_their_names_where_the_table_saturates(
    renderer, catalogue, lemon, pear
) -> None:
    perception = renderer.perception(catalogue)
    things = lemon(0.45, 0.15), pear(0.40, -0.2)
    settle(perception, renderer, *things)
    seen = settle(perception, renderer, *things, change=lit(2.0))
    assert (seen.reason, [o.state for o in seen.objects]) == ('', [LEFT, RIGHT])
    assert all(max(o.state_probability) <= o.identity_probability + 0.1 for o in seen.objects)
    # What is gone is off the table, as under any light.
    seen = settle(perception, renderer, things[1], change=lit(2.0))
    assert [o.state for o in seen.objects] == [OFFTABLE, RIGHT]


def test_a_light_that_nothing_tells_leaves_states_unknown(
    renderer, catalogue, lemon, pear
) -> None:
    perception = renderer.perception(catalogue)
    things = lemon(0.45, 0.15), pear(0.40, -0.2)
    settle(perception, renderer, *things)
    seen = settle(perception, renderer, *things, change=lit(4.0))
    assert (seen.reason, [o.state for o in seen.objects]) == (OVEREXPOSED, [None, None])


@pytest.mark.parametrize(('places', 'states'), [(0, [None, None]), (2, [LEFT, RIGHT])])
def test_a_light_that_was_there_from_the_start_is_told_by_known_places(
    renderer, catalogue, lemon, pear, places, states
) -> None:
    posts = [
        replace(lemon(0.14, y, -0.1), radius=0.06, colour=(60, 70, 80)) for y in (-0.15, 0.05)
    ]
    spots = [DarkPlace((0.14, post.centre[1], -0.04), post.colour) for post in posts]
    table = replace(WORLD.table, dark=tuple(spots[:places]))
    renderer.config = replace(renderer.config, world=replace(WORLD, table=table))
    perception = TabletopPerception(renderer.config, renderer.intrinsics, catalogue)
    things = lemon(0.45, 0.15), pear(0.40, -0.2), *posts
    seen = settle(perception, renderer, *things, frames=12, change=lit(2.3))
    assert [o.state for o in seen.objects] == states


def test_objects_whose_clipped_colours_are_the_same_are_not_told(
    renderer, catalogue, lemon, pear
) -> None:
    bright = catalogue.objects[0]
    dull = replace(
        bright, name='dull', colour=(ColourComponent(1.0, (62.0, -6.0, 62.0), (8.0, 4.0, 6.0)),)
    )
    perception = renderer.perception(Catalogue((bright, dull)))
    brown = replace(pear(0.40, -0.2), colour=(163, 149, 24))
    seen = settle(perception, renderer, lemon(0.45, 0.15), brown, change=lit(2.0))
    assert [o.state for o in seen.objects] == [None, None]
    alone = settle(perception, renderer, lemon(0.45, 0.15), change=lit(2.0))
    assert [o.state for o in alone.objects] == [None, None]
    usual = settle(perception, renderer, lemon(0.45, 0.15), brown)
    assert [o.state for o in usual.objects] == [LEFT, RIGHT]
    # What has not moved since it was told is what it was.
    seen = settle(perception, renderer, lemon(0.45, 0.15), brown, change=lit(2.0))
    assert [o.state for o in seen.objects] == [LEFT, RIGHT]


def test_what_is_left_of_two_after_a_hand_is_no_surer_than_before(
    renderer, catalogue, lemon, forearm
) -> None:
    perception = renderer.perception(Catalogue(catalogue.objects[:1]))
    left, right = lemon(0.45, 0.15), lemon(0.40, -0.2)
    seen = settle(perception, renderer, left, right, change=lit(2.0))
    assert seen.object('lemon').state is None
    arms = forearm(0.40, 0.15, 0.05), forearm(0.35, -0.2, 0.05)
    settle(perception, renderer, left, *arms, change=lit(2.0))
    seen = settle(perception, renderer, left, change=lit(2.0))
    assert seen.object('lemon').state is None


def test_what_is_white_where_the_table_saturates_is_no_object(
    renderer, catalogue, lemon, pear
) -> None:
    perception = renderer.perception(catalogue)
    white = replace(pear(0.40, -0.2), colour=(190, 190, 190))
    seen = settle(perception, renderer, lemon(0.45, 0.15), white, change=lit(2.0))
    assert (seen.object('lemon').state, seen.object('pear').visible) == (LEFT, False)


def test_scattered_holes_hide_no_object(renderer, catalogue, lemon, pear) -> None:
    perception = renderer.perception(catalogue)
    things = lemon(0.45, 0.15), pear(0.40, -0.2)
    seen = settle(perception, renderer, *things, frames=12, change=without_depth(0.3))
    assert [o.state for o in seen.objects] == [LEFT, RIGHT]


def test_only_scattered_holes_are_filled(renderer) -> None:
    frame = renderer.frame()
    few = without_depth(0.005)(frame)
    assert with_holes_filled(few) is few
    block = frame.depth.copy()
    block[100:140, 100:200] = np.nan
    filled = with_holes_filled(without_depth(0.2)(replace(frame, depth=block)))
    assert np.isnan(filled.depth[105:135, 105:195]).all()
    known = np.isfinite(filled.depth)
    assert known[:90].mean() > 0.99
    far_off = np.abs(filled.depth - frame.depth)[known] > 0.01
    assert far_off.mean() < 0.02


def turned(renderer, axis: tuple[float, float, float], degrees: float) -> None:
    """Turn the renderer's camera about an axis of its optical frame."""
    pose = renderer.view.pose.copy()
    unit = np.array(axis) / np.linalg.norm(axis)
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(np.radians(degrees) * unit).as_matrix()
    renderer.view = CameraView(renderer.intrinsics, pose)
    renderer._directions = renderer.view.directions.astype(np.float64)


@pytest.mark.parametrize('axis', [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
def test_a_moved_camera_is_noticed_within_two_seconds(renderer, catalogue, lemon, axis) -> None:
    perception = renderer.perception(catalogue)
    assert settle(perception, renderer, lemon(0.45, 0.15), frames=20).reason == ''
    turned(renderer, axis, 1.0)
    seen = settle(perception, renderer, lemon(0.45, 0.15), frames=20)
    assert (seen.reason, seen.object('lemon').state) == (CAMERA_MOVED, None)
    turned(renderer, axis, -1.0)
    assert settle(perception, renderer, lemon(0.45, 0.15)).reason == CAMERA_MOVED
    again = TabletopPerception(renderer.config, renderer.intrinsics, catalogue)
    seen = settle(again, renderer, lemon(0.45, 0.15), frames=12)
    assert seen.object('lemon').state == LEFT


def test_absence_needs_the_whole_table_in_view(renderer, catalogue, lemon) -> None:
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, 0.15))
    row, column = (round(v) for v in renderer.view.project(np.array([[0.40, -0.2, 0]]))[0][::-1])

    def hole(frame):
        depth = frame.depth.copy()
        depth[row - 24 : row + 24, column - 24 : column + 24] = np.nan
        return replace(frame, depth=depth)

    seen = settle(perception, renderer, change=hole).object('lemon')
    assert (seen.state, seen.settled) == (None, False)
    assert settle(perception, renderer).object('lemon').state == OFFTABLE


def test_what_a_hand_covers_at_the_start_is_unknown_until_it_is_seen(
    renderer, catalogue, lemon, pear, forearm
) -> None:
    perception = TabletopPerception(renderer.config, renderer.intrinsics, catalogue)
    things = lemon(0.45, 0.15), pear(0.40, -0.2)
    seen = settle(perception, renderer, *things, forearm(0.36, 0.19, 0.12), frames=12)
    assert [o.state for o in seen.objects] == [None, RIGHT]
    seen = settle(perception, renderer, *things, frames=12)
    assert [o.state for o in seen.objects] == [LEFT, RIGHT]


def test_what_is_off_the_table_may_be_in_a_hand(renderer, catalogue, lemon, forearm) -> None:
    perception = renderer.perception(catalogue)
    assert settle(perception, renderer, lemon(0.45, 0.15)).object('pear').state == OFFTABLE
    hand = forearm(0.45, -0.1, 0.12)
    assert settle(perception, renderer, lemon(0.45, 0.15), hand).object('pear').state is None
    assert settle(perception, renderer, lemon(0.45, 0.15), frames=5).object('pear').state == (
        OFFTABLE
    )


def test_a_longer_thing_of_the_same_colour_is_not_the_object(
    renderer, catalogue, lemon, forearm
) -> None:
    perception = renderer.perception(catalogue)
    long = replace(
        forearm(0.38, 0.15, 0.03), end=(0.52, 0.15, 0.03), radius=0.03, colour=lemon(0, 0).colour
    )
    seen = settle(perception, renderer, long)
    assert (seen.object('lemon').visible, seen.object('lemon').state) == (False, None)
    assert len(seen.unknown_objects) == 1


def test_a_box_that_is_put_down_is_no_hand_for_long(renderer, catalogue, lemon, forearm) -> None:
    perception = renderer.perception(catalogue)
    box = replace(forearm(0.45, -0.30, 0.03), end=(0.45, 0.02, 0.03), colour=(90, 60, 40))
    assert settle(perception, renderer, lemon(0.45, 0.2), box, frames=3).hand_in_view
    seen = settle(perception, renderer, lemon(0.45, 0.2), box, frames=25)
    assert (seen.hand_in_view, seen.object('lemon').state) == (False, LEFT)
    assert seen.object('pear').state is None  # It may be under the box.


def test_a_hand_that_stops_with_an_object_has_not_placed_it(
    renderer, catalogue, lemon, forearm
) -> None:
    renderer.config = replace(renderer.config, still_time=0.5)
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.40, -0.15))
    acts, reasons = [], []

    def carry(*places: tuple[float, float], frames: int) -> None:
        for y, z in places:
            for _ in range(frames):
                things = lemon(0.40, y, z), forearm(0.47, y, z + 0.06)
                seen = perception.process(renderer.frame(*things))
                acts.extend(seen.demonstrations)
                reasons.extend(str(each.reason) for each in seen.unresolved)

    carry((-0.15, 0.12), (0.0, 0.12), (0.15, 0.12), frames=1)
    carry((0.15, 0.12), frames=15)
    assert (acts, reasons) == ([], ['hand stopped moving'])
    carry((0.05, 0.12), (0.15, 0.07), (0.22, 0.03), frames=1)
    for _ in range(10):
        acts.extend(perception.process(renderer.frame(lemon(0.40, 0.22))).demonstrations)
    assert [(a.object, a.x_i, a.x_f) for a in acts] == [('lemon', RIGHT, LEFT)]
