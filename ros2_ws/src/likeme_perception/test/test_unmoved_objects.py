"""Objects whose colours change while they lie still, and what is claimed of those that move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT

BLUE = (40, 70, 200)


def settle(perception, renderer, *things, frames: int = 8, change=lambda frame: frame):
    """Process the same scene for some frames; the last observation."""
    for _ in range(frames):
        seen = perception.process(change(renderer.frame(*things)))
    return seen


def shaded(columns: slice, *factors: float):
    """A shadow, or a coloured light, over some columns of the image."""

    def change(frame):
        rgb = frame.rgb.astype(float)
        rgb[:, columns] *= factors
        return replace(frame, rgb=np.clip(rgb, 0, 255).astype(np.uint8))

    return change


@pytest.mark.parametrize('factors', [(0.3, 0.3, 0.3), (1.1, 0.7, 0.4), (0.2, 0.4, 1.6)])
def test_a_shadow_takes_no_object_away(renderer, catalogue, lemon, pear, factors) -> None:
    perception = renderer.perception(catalogue)
    things = lemon(0.45, 0.15), pear(0.40, -0.2)
    settle(perception, renderer, *things)
    for columns in (slice(0, 160), slice(160, 320)):
        for _ in range(8):
            frame = shaded(columns, *factors)(renderer.frame(*things))
            seen = perception.process(frame)
            assert [o.state for o in seen.objects] == [LEFT, RIGHT]


def test_what_lies_where_an_object_lay_may_be_that_object(
    renderer, catalogue, lemon, pear, forearm
) -> None:
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, 0.15), pear(0.40, -0.2))
    settle(perception, renderer, pear(0.40, -0.2), forearm(0.40, 0.15, 0.05), frames=4)
    blue = replace(lemon(0.45, 0.15), colour=BLUE)
    seen = settle(perception, renderer, blue, pear(0.40, -0.2), frames=12)
    assert seen.object('lemon').state is None
    assert 'something in view may be it' in seen.object('lemon').reason
    seen = settle(perception, renderer, pear(0.40, -0.2), frames=12)
    assert seen.object('lemon').state == OFFTABLE


def test_an_object_is_not_elsewhere_while_its_place_has_not_changed(
    renderer, catalogue, lemon, pear
) -> None:
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, 0.15), pear(0.40, -0.2))
    # What lay on the left is green now, and yellow is where nothing was.
    green = replace(lemon(0.45, 0.15), colour=pear(0, 0).colour)
    seen = settle(perception, renderer, green, pear(0.40, -0.2), lemon(0.5, -0.1))
    assert seen.object('lemon').state == LEFT
    assert seen.object('pear').state == RIGHT


def test_what_moves_is_where_it_is_no_surer_than_the_images_are_in_step(
    renderer, catalogue, lemon, pear
) -> None:
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, 0.15), pear(0.40, -0.2))
    told = []
    for y in np.arange(0.15, -0.15, -0.04):
        seen = perception.process(renderer.frame(lemon(0.45, y), pear(0.40, -0.2)))
        told.append((y, max(seen.object('lemon').state_probability)))
    near = [p for y, p in told if abs(y) < 0.06]
    assert near
    assert max(near) < 0.99
    rested = settle(perception, renderer, lemon(0.45, -0.13), pear(0.40, -0.2))
    assert max(rested.object('lemon').state_probability) > 0.99


def test_a_part_in_a_hand_from_outside_is_not_surely_the_object(
    renderer, catalogue, lemon, pear, forearm
) -> None:
    perception = renderer.perception(catalogue)
    gone = settle(perception, renderer, pear(0.40, -0.2), frames=12)
    assert gone.object('lemon').state == OFFTABLE
    held = [
        perception.process(
            renderer.frame(pear(0.40, -0.2), forearm(x, 0.15, 0.10), lemon(x - 0.045, 0.15, 0.09))
        ).object('lemon')
        for x in (0.62, 0.60, 0.58, 0.56, 0.54)
    ]
    assert any(o.visible for o in held)
    assert all(max(o.state_probability) < 0.9 for o in held if o.visible and o.state == LEFT)
    down = settle(perception, renderer, pear(0.40, -0.2), lemon(0.50, 0.15))
    assert down.object('lemon').state == LEFT
    assert max(down.object('lemon').state_probability) > 0.99
