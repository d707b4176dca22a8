"""The whole of perception on small synthetic frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from likeme_core.tabletop import State
from likeme_perception.identification import (
    Catalogue,
    catalogue_entry,
    catalogue_yaml,
    load_catalogue,
)


def settle(perception, studio, *things, frames: int = 8):
    """Show the same things for some frames; the last observation."""
    for _ in range(frames):
        seen = perception.process(studio.frame(*things))
    return seen


def test_nothing_is_said_before_the_background_is_known(studio, catalogue, lemon) -> None:
    from likeme_perception.pipeline import TabletopPerception

    perception = TabletopPerception(studio.config, studio.intrinsics, catalogue)
    first = [perception.process(studio.frame(lemon(0.45, 0.1))) for _ in range(5)]
    assert [seen.learned for seen in first] == [False] * 4 + [True]
    assert first[0].objects == ()
    assert first[4].object('lemon').visible


def test_two_objects_are_told_apart_placed_and_settled(studio, catalogue, lemon, pear) -> None:
    perception = studio.perception(catalogue)
    seen = settle(perception, studio, lemon(0.45, 0.15), pear(0.40, -0.2))
    assert seen.settled
    assert not seen.hand_in_view
    for name, xy, state in (
        ('lemon', (0.45, 0.15), State.LEFT),
        ('pear', (0.40, -0.2), State.RIGHT),
    ):
        found = seen.object(name)
        assert found.state is state
        assert found.settled
        assert found.identity_probability > 0.9
        assert np.hypot(found.centroid[0] - xy[0], found.centroid[1] - xy[1]) < 0.004
        assert sum(found.state_probability) == pytest.approx(1.0)
        assert max(found.state_probability) > 0.99


def test_every_object_of_the_catalogue_is_reported_once(studio, catalogue, lemon) -> None:
    seen = settle(studio.perception(catalogue), studio, lemon(0.45, 0.15))
    assert [o.name for o in seen.objects] == ['lemon', 'pear']
    missing = seen.object('pear')
    assert missing.state is State.OFFTABLE
    assert missing.settled
    assert not missing.visible
    assert np.isnan(missing.centroid).all()


def test_beside_the_work_area_and_on_the_floor_are_offtable(
    studio, catalogue, lemon, pear
) -> None:
    seen = settle(studio.perception(catalogue), studio, lemon(0.45, 0.36), pear(0.40, 0.50, -0.17))
    assert seen.object('lemon').visible
    assert seen.object('pear').visible
    assert {o.state for o in seen.objects} == {State.OFFTABLE}
    assert seen.settled


def test_what_is_in_no_catalogue_is_a_thing(studio, catalogue, lemon) -> None:
    from dataclasses import replace

    red = replace(lemon(0.5, -0.1), colour=(200, 20, 40))
    seen = settle(studio.perception(catalogue), studio, red)
    assert len(seen.things) == 1
    assert not any(o.visible for o in seen.objects)


def test_a_hand_hides_an_object_and_another_stays_known(
    studio, catalogue, lemon, pear, forearm
) -> None:
    perception = studio.perception(catalogue)
    settle(perception, studio, lemon(0.45, 0.15), pear(0.40, -0.2))
    seen = settle(
        perception, studio, lemon(0.45, 0.15), pear(0.40, -0.2), forearm(0.36, 0.19, 0.12)
    )
    assert seen.hand_in_view
    assert not seen.arm_in_view
    assert not seen.settled
    assert seen.object('lemon').state is None
    assert seen.object('lemon').state_probability == pytest.approx((1 / 3,) * 3)
    assert seen.object('pear').state is State.RIGHT
    assert seen.hand_tip is not None


def test_the_robots_own_arm_is_not_a_hand(studio, catalogue, lemon, robot_arm) -> None:
    perception = studio.perception(catalogue)
    settle(perception, studio, lemon(0.50, 0.15))
    seen = settle(perception, studio, lemon(0.50, 0.15), robot_arm(0.45, -0.1, 0.08))
    assert seen.arm_in_view
    assert not seen.hand_in_view
    assert seen.object('lemon').state is State.LEFT


def test_a_resting_object_half_hidden_keeps_its_middle(
    studio, catalogue, lemon, robot_arm
) -> None:
    perception = studio.perception(catalogue)
    whole = settle(perception, studio, lemon(0.45, 0.05)).object('lemon')
    seen = settle(perception, studio, lemon(0.45, 0.05), robot_arm(0.45, 0.0, 0.08))
    half = seen.object('lemon')
    assert seen.arm_in_view
    assert half.visible
    assert not half.settled
    assert np.hypot(*(np.subtract(half.centroid, whole.centroid)[:2])) < 0.008


def test_an_object_that_vanishes_without_a_hand_is_offtable(studio, catalogue, lemon) -> None:
    perception = studio.perception(catalogue)
    settle(perception, studio, lemon(0.45, 0.15))
    first = perception.process(studio.frame()).object('lemon')
    assert first.state is State.LEFT
    assert not first.visible
    assert not first.settled
    later = settle(perception, studio).object('lemon')
    assert later.state is State.OFFTABLE
    assert later.settled
    assert later.last_seen < perception.process(studio.frame()).stamp


def test_touching_things_of_different_colours_come_apart(studio, catalogue, lemon, pear) -> None:
    seen = settle(studio.perception(catalogue), studio, lemon(0.45, 0.130), pear(0.45, 0.072))
    for name, y in (('lemon', 0.130), ('pear', 0.072)):
        assert abs(seen.object(name).centroid[1] - y) < 0.008


def test_a_demonstration_by_hand_is_seen(studio, catalogue, lemon, forearm) -> None:
    perception = studio.perception(catalogue)
    settle(perception, studio, lemon(0.45, -0.15))
    acts = []
    for y, z in (
        (-0.15, 0.10),
        (-0.15, 0.14),
        (-0.05, 0.16),
        (0.05, 0.16),
        (0.15, 0.14),
        (0.15, 0.1),
    ):
        for _ in range(2):
            held = lemon(0.40, y, max(0.03, z - 0.06))
            acts += perception.process(studio.frame(held, forearm(0.47, y, z))).demonstrations
    for _ in range(10):
        acts += perception.process(studio.frame(lemon(0.40, 0.15))).demonstrations
    assert [(a.object, a.x_i, a.x_f) for a in acts] == [('lemon', State.RIGHT, State.LEFT)]
    assert acts[0].start < acts[0].end


def test_what_is_put_across_the_tables_edge_becomes_background(studio, catalogue, forearm) -> None:
    from dataclasses import replace

    studio.config = replace(studio.config, still_time=1.0)
    perception = studio.perception(catalogue)
    assert settle(perception, studio, forearm(0.5, 0.1, 0.1), frames=3).hand_in_view
    assert not settle(perception, studio, forearm(0.5, 0.1, 0.1), frames=25).hand_in_view
    assert perception.absorbed == 1


@pytest.fixture
def soon_still(studio):
    """The studio with a perception that takes what is still for 1 s for background."""
    from dataclasses import replace

    studio.config = replace(studio.config, still_time=1.0)
    return studio


def test_an_object_under_what_is_held_still_is_unknown_until_it_is_seen(
    soon_still, catalogue, lemon, pear, forearm
) -> None:
    perception = soon_still.perception(catalogue)
    resting = lemon(0.45, 0.15), pear(0.40, -0.2)
    settle(perception, soon_still, *resting)
    seen = settle(perception, soon_still, *resting, forearm(0.36, 0.19, 0.12), frames=30)
    assert (perception.absorbed, seen.hand_in_view) == (1, False)
    assert seen.object('lemon').state is None
    assert not seen.settled
    leaving = settle(perception, soon_still, *resting, forearm(0.45, -0.02, 0.12), frames=3)
    assert leaving.hand_in_view
    seen = settle(perception, soon_still, *resting, frames=10)
    assert [o.state for o in seen.objects] == [State.LEFT, State.RIGHT]
    assert seen.settled
    assert seen.things == ()


def test_the_table_recovers_where_something_was_held_still(
    soon_still, catalogue, lemon, pear, forearm, robot_arm
) -> None:
    perception = soon_still.perception(catalogue)
    before = perception.background
    start, end = pear(0.40, -0.2), pear(0.45, 0.15)
    settle(perception, soon_still, start)
    for limb in (forearm(0.38, 0.15, 0.1), robot_arm(0.45, 0.1, 0.08)):
        settle(perception, soon_still, start, limb, frames=25)
    assert perception.absorbed == 2
    settle(perception, soon_still, start, frames=3)
    assert (perception.background.nearest == before.nearest).all()
    assert (perception.background.table == before.table).all()
    acts = []
    for y in (-0.2, -0.1, 0.0, 0.1, 0.15):
        for _ in range(2):
            held = pear(0.40, y, 0.10), forearm(0.47, y, 0.16)
            acts += perception.process(soon_still.frame(*held)).demonstrations
    for _ in range(10):
        acts += perception.process(soon_still.frame(end)).demonstrations
    assert [(a.object, a.x_i, a.x_f) for a in acts] == [('pear', State.RIGHT, State.LEFT)]


def test_what_stands_beside_and_below_the_table_is_no_thing_on_it(
    studio, catalogue, lemon
) -> None:
    from dataclasses import replace

    red = replace(lemon(0.40, 0.50, -0.17), colour=(200, 20, 40))
    tall = replace(lemon(0.45, 0.50, -0.10), radius=0.08, colour=(200, 20, 40))
    for thing in (red, tall):
        assert settle(studio.perception(catalogue), studio, thing).things == ()


def test_an_object_can_be_added_to_the_catalogue_from_frames(
    studio, lemon, pear, tmp_path
) -> None:
    perception = studio.perception(Catalogue(()))
    frame = studio.frame(lemon(0.45, 0.15))
    pixels, shape = perception.process(frame).things[0]
    colours = frame.rgb.reshape(-1, 3)[pixels]
    entry = catalogue_entry('banana', [colours], [shape], [0.0028])
    (tmp_path / 'known.yaml').write_text(catalogue_yaml(Catalogue((entry,))))
    known = load_catalogue(tmp_path / 'known.yaml')
    assert known.objects == (entry,)
    seen = settle(studio.perception(known), studio, pear(0.4, -0.1), lemon(0.5, 0.2))
    assert seen.object('banana').state is State.LEFT
    assert len(seen.things) == 1


def test_what_reaches_in_may_look_like_a_known_thing_all_over(studio, catalogue, forearm) -> None:
    perception = studio.perception(catalogue)
    painted = replace(forearm(0.62, 0.1, 0.03), colour=(235, 205, 40))
    seen = [perception.process(studio.frame(painted)) for _ in range(3)]
    assert all(len(table.objects) == 2 for table in seen)
