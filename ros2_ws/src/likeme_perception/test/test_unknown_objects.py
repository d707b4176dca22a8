"""Objects that are in no catalogue, and several of a kind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from std_msgs.msg import Header

from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
from likeme_perception.messages import table_state
from likeme_perception.pipeline import TWO_OF_A_KIND, TabletopPerception
from likeme_perception.top_view import Shape
from likeme_perception.unknown_objects import UnknownObject, UnknownObjectNames


def settle(perception, renderer, *things, frames: int = 8):
    """Process the same scene for some frames; the last observation."""
    for _ in range(frames):
        seen = perception.process(renderer.frame(*things))
    return seen


def names(seen) -> list[str]:
    return sorted(each.name for each in seen.unknown_objects)


def test_objects_in_no_catalogue_are_published_with_place_size_and_probability(
    renderer, catalogue, lemon
) -> None:
    red, blue = (
        replace(lemon(x, y), colour=colour)
        for x, y, colour in ((0.5, -0.1, (200, 20, 40)), (0.4, 0.1, (30, 50, 200)))
    )
    perception = renderer.perception(catalogue)
    settle(perception, renderer, red)
    seen = settle(perception, renderer, red, blue)
    assert names(seen) == ['unknown_1', 'unknown_2']
    message = table_state(seen, Header(frame_id='camera'), 'base_link', WORLD)
    first = next(m for m in message.unknown_objects if m.name == 'unknown_1')
    assert (first.centroid.x, first.centroid.y) == pytest.approx((0.5, -0.1), abs=0.005)
    assert first.major_axis_length == pytest.approx(0.06, abs=0.015)
    assert first.height == pytest.approx(0.06, abs=0.01)
    assert first.unknown_probability > 0.99
    assert first.fits == ''
    # The other keeps its number when the first is taken away.
    assert names(settle(perception, renderer, blue)) == ['unknown_2']


@pytest.mark.parametrize('radius', [0.016, 0.052])
def test_the_lemons_colour_alone_makes_no_lemon(renderer, catalogue, lemon, radius: float) -> None:
    other = replace(lemon(0.45, 0.1, radius), radius=radius)
    seen = settle(renderer.perception(catalogue), renderer, other)
    assert not seen.object('lemon').visible
    assert seen.object('lemon').state is None  # Something hides what may be it.
    assert names(seen) == ['unknown_1']
    assert seen.unknown_objects[0].probability > 0.9


@pytest.mark.parametrize('hidden_by', ['edge', 'box'])
def test_half_an_object_is_still_the_object(
    renderer, catalogue, lemon, forearm, hidden_by
) -> None:
    perception = renderer.perception(catalogue)
    ball = lemon(0.45, 0.1)
    if hidden_by == 'box':
        post = replace(forearm(0.40, 0.15, 0.02), end=(0.40, 0.15, 0.10), radius=0.02)
        seen = settle(perception, renderer, ball, replace(post, colour=(30, 50, 200)))
    else:
        # A strip of the image without depth ends it where the image would.
        frames = [renderer.frame(ball) for _ in range(8)]
        row, column = perception.background.view.project(np.array([ball.centre]))[0][::-1]
        depth = [f.depth.copy() for f in frames]
        assert 0 < row < depth[0].shape[0]
        for f, d in zip(frames, depth, strict=True):
            d[:, int(column) + 4 :] = 0.3
            seen = perception.process(replace(f, depth=d))
    assert seen.object('lemon').visible


def test_of_two_lemons_at_the_start_neither_is_the_lemon(renderer, catalogue, lemon, pear) -> None:
    perception = renderer.perception(catalogue)
    two = lemon(0.45, 0.15), lemon(0.45, -0.15)
    seen = settle(perception, renderer, *two, pear(0.35, -0.1))
    said = seen.object('lemon')
    assert (said.state, said.reason) == (None, TWO_OF_A_KIND)
    assert names(seen) == ['lemon_1', 'lemon_2']
    assert seen.object('pear').state == RIGHT
    assert not seen.settled
    # One alone may be either.
    said = settle(perception, renderer, two[0]).object('lemon')
    assert (said.state, said.reason) == (None, TWO_OF_A_KIND)
    perception.reset_tracking()
    assert settle(perception, renderer, two[0]).object('lemon').state == LEFT


@pytest.fixture
def with_second(renderer, catalogue, lemon, forearm) -> TabletopPerception:
    """Perception that has seen a lemon LEFT, and a hand put a second one RIGHT."""
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, 0.15))
    settle(perception, renderer, lemon(0.45, 0.15), lemon(0.45, -0.2), forearm(0.5, -0.2, 0.08))
    seen = settle(perception, renderer, lemon(0.45, 0.15), lemon(0.45, -0.2))
    assert (seen.object('lemon').state, names(seen)) == (LEFT, ['lemon_2'])
    assert seen.unknown_objects[0].fits == 'lemon'
    return perception


def test_the_known_of_two_lemons_is_followed_through_a_hand(
    renderer, with_second, lemon, forearm
) -> None:
    for y in (0.1, 0.0, -0.05):
        hand = forearm(0.45, y, 0.06)
        seen = settle(with_second, renderer, lemon(0.45, y), lemon(0.45, -0.2), hand, frames=2)
        assert seen.object('lemon').state is None
    seen = settle(with_second, renderer, lemon(0.45, -0.05), lemon(0.45, -0.2))
    assert (seen.object('lemon').state, names(seen)) == (RIGHT, ['lemon_2'])
    assert seen.object('lemon').centroid[1] == pytest.approx(-0.05, abs=0.005)


def test_two_lemons_that_were_both_moved_are_not_told_apart(
    renderer, with_second, lemon, forearm
) -> None:
    settle(with_second, renderer, forearm(0.45, 0.0, 0.06), frames=3)
    seen = settle(with_second, renderer, lemon(0.35, 0.15), lemon(0.35, -0.2))
    assert (seen.object('lemon').state, seen.object('lemon').reason) == (None, TWO_OF_A_KIND)
    assert [each.fits for each in seen.unknown_objects] == ['lemon', 'lemon']


def test_the_second_lemon_can_be_taken_away(renderer, with_second, lemon, forearm) -> None:
    settle(with_second, renderer, lemon(0.45, 0.15), forearm(0.45, -0.2, 0.06), frames=3)
    seen = settle(with_second, renderer, lemon(0.45, 0.15))
    assert (seen.object('lemon').state, names(seen)) == (LEFT, [])
    assert seen.object('pear').state == OFFTABLE
    assert seen.settled


def thing(x: float, fits: str = '') -> UnknownObject:
    none = np.zeros(0, np.intp)
    return UnknownObject('', fits, 1.0, none, Shape((x, 0.0, 0.02), 0.0, 0.05, 0.05, 0.04))


def test_a_name_is_kept_behind_a_hand_and_free_when_its_object_is_gone() -> None:
    known = UnknownObjectNames(absence_time=0.3)

    def said(stamp: float, limb: bool, *things: UnknownObject) -> list[str]:
        found = known.named(things, int(stamp * 1e9), limb, frozenset({'lemon'}))
        return [each.name for each in found]

    assert said(0.0, False, thing(0.3), thing(0.5)) == ['unknown_1', 'unknown_2']
    assert said(0.1, False, thing(0.51), thing(0.31)) == ['unknown_2', 'unknown_1']
    assert said(5.0, True, thing(0.51)) == ['unknown_2']
    assert said(9.0, False, thing(0.51), thing(0.3)) == ['unknown_2', 'unknown_1']
    assert said(9.4, False, thing(0.51)) == ['unknown_2']
    assert said(9.5, False, thing(0.2), thing(0.51)) == ['unknown_1', 'unknown_2']
    assert said(9.6, False, thing(0.2, 'lemon'), thing(0.4, 'pear')) == ['lemon_2', 'pear_1']
