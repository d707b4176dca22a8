"""The pipeline on small synthetic frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml

from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT
from likeme_core.world.file import parse_world, world_path
from likeme_perception.catalogue import Catalogue, catalogue_entry, object_yaml, world_catalogue
from likeme_perception.observation import UnresolvedReason
from likeme_perception.pipeline import TabletopPerception


def settle(perception, renderer, *things, frames: int = 8):
    """Process the same scene for some frames; the last observation."""
    for _ in range(frames):
        seen = perception.process(renderer.frame(*things))
    return seen


def test_no_objects_before_the_background_is_known(renderer, catalogue, lemon) -> None:
    perception = TabletopPerception(renderer.config, renderer.intrinsics, catalogue)
    first = [perception.process(renderer.frame(lemon(0.45, 0.1))) for _ in range(5)]
    assert [seen.learned for seen in first] == [False] * 4 + [True]
    assert first[0].objects == ()
    assert first[4].object('lemon').visible


def test_two_objects_are_identified_located_and_settled(renderer, catalogue, lemon, pear) -> None:
    perception = renderer.perception(catalogue)
    seen = settle(perception, renderer, lemon(0.45, 0.15), pear(0.40, -0.2))
    assert seen.settled
    assert not seen.hand_in_view
    for name, xy, state in (
        ('lemon', (0.45, 0.15), LEFT),
        ('pear', (0.40, -0.2), RIGHT),
    ):
        found = seen.object(name)
        assert found.state is state
        assert found.settled
        assert found.identity_probability > 0.9
        assert np.hypot(found.centroid[0] - xy[0], found.centroid[1] - xy[1]) < 0.004
        assert sum(found.state_probability) == pytest.approx(1.0)
        assert max(found.state_probability) > 0.99


def test_every_object_of_the_catalogue_is_reported_once(renderer, catalogue, lemon) -> None:
    seen = settle(renderer.perception(catalogue), renderer, lemon(0.45, 0.15))
    assert [o.name for o in seen.objects] == ['lemon', 'pear']
    missing = seen.object('pear')
    assert missing.state == OFFTABLE
    assert missing.settled
    assert not missing.visible
    assert np.isnan(missing.centroid).all()


def test_beside_the_work_area_and_on_the_floor_are_offtable(
    renderer, catalogue, lemon, pear
) -> None:
    seen = settle(
        renderer.perception(catalogue), renderer, lemon(0.45, 0.36), pear(0.40, 0.50, -0.17)
    )
    assert seen.object('lemon').visible
    assert seen.object('pear').visible
    assert {o.state for o in seen.objects} == {OFFTABLE}
    assert seen.settled


def test_an_object_not_in_the_catalogue_is_reported_as_a_thing(renderer, catalogue, lemon) -> None:
    red = replace(lemon(0.5, -0.1), colour=(200, 20, 40))
    seen = settle(renderer.perception(catalogue), renderer, red)
    assert len(seen.unknown_objects) == 1
    assert not any(o.visible for o in seen.objects)


def test_only_the_object_under_the_hand_becomes_unknown(
    renderer, catalogue, lemon, pear, forearm
) -> None:
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, 0.15), pear(0.40, -0.2))
    seen = settle(
        perception, renderer, lemon(0.45, 0.15), pear(0.40, -0.2), forearm(0.36, 0.19, 0.12)
    )
    assert seen.hand_in_view
    assert not seen.arm_in_view
    assert not seen.settled
    assert seen.object('lemon').state is None
    assert seen.object('lemon').state_probability == pytest.approx((1 / 3,) * 3)
    assert seen.object('pear').state == RIGHT
    assert seen.hand_tip is not None


def test_the_robots_own_arm_is_not_a_hand(renderer, catalogue, lemon, robot_arm) -> None:
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.50, 0.15))
    seen = settle(perception, renderer, lemon(0.50, 0.15), robot_arm(0.45, -0.1, 0.08))
    assert seen.arm_in_view
    assert not seen.hand_in_view
    assert seen.object('lemon').state == LEFT


def test_a_hand_that_reaches_over_no_edge_any_more_is_still_a_hand(
    renderer, catalogue, lemon, forearm
) -> None:
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, -0.15))
    reaching = replace(forearm(0.30, 0.25, 0.10), end=(0.80, 0.27, 0.33))
    seen = settle(perception, renderer, lemon(0.45, -0.15), reaching, frames=2)
    assert (seen.hand_in_view, seen.arm_in_view) == (True, False)
    for end in ((0.62, 0.26, 0.36), (0.56, 0.26, 0.36), (0.5, 0.26, 0.36)):
        raised = replace(reaching, end=end)
        seen = perception.process(renderer.frame(lemon(0.45, -0.15), raised))
        assert (seen.hand_in_view, seen.arm_in_view) == (True, False)


def test_a_partly_hidden_object_at_rest_keeps_its_centroid(
    renderer, catalogue, lemon, robot_arm
) -> None:
    perception = renderer.perception(catalogue)
    whole = settle(perception, renderer, lemon(0.45, 0.05)).object('lemon')
    seen = settle(perception, renderer, lemon(0.45, 0.05), robot_arm(0.45, 0.0, 0.08))
    half = seen.object('lemon')
    assert seen.arm_in_view
    assert half.visible
    assert not half.settled
    assert np.hypot(*(np.subtract(half.centroid, whole.centroid)[:2])) < 0.008


def test_an_object_that_vanishes_without_a_hand_is_offtable(renderer, catalogue, lemon) -> None:
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, 0.15))
    first = perception.process(renderer.frame()).object('lemon')
    assert first.state == LEFT
    assert not first.visible
    assert not first.settled
    later = settle(perception, renderer).object('lemon')
    assert later.state == OFFTABLE
    assert later.settled
    assert later.last_seen < perception.process(renderer.frame()).stamp


def test_touching_objects_of_different_colours_are_split(renderer, catalogue, lemon, pear) -> None:
    seen = settle(renderer.perception(catalogue), renderer, lemon(0.45, 0.130), pear(0.45, 0.072))
    for name, y in (('lemon', 0.130), ('pear', 0.072)):
        assert abs(seen.object(name).centroid[1] - y) < 0.008


def test_a_demonstration_by_hand_is_seen(renderer, catalogue, lemon, forearm) -> None:
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, -0.15))
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
            acts += perception.process(renderer.frame(held, forearm(0.47, y, z))).demonstrations
    for _ in range(10):
        acts += perception.process(renderer.frame(lemon(0.40, 0.15))).demonstrations
    assert [(a.object, a.x_i, a.x_f) for a in acts] == [('lemon', RIGHT, LEFT)]
    assert acts[0].start < acts[0].end


def test_a_limb_that_does_not_move_becomes_background(renderer, catalogue, forearm) -> None:
    renderer.config = replace(renderer.config, still_time=1.0)
    perception = renderer.perception(catalogue)
    assert settle(perception, renderer, forearm(0.5, 0.1, 0.1), frames=3).hand_in_view
    assert not settle(perception, renderer, forearm(0.5, 0.1, 0.1), frames=25).hand_in_view
    assert perception.absorbed_count == 1


@pytest.fixture
def short_still_time(renderer):
    """The renderer, with a still_time of 1 s."""
    renderer.config = replace(renderer.config, still_time=1.0)
    return renderer


def test_an_object_under_an_absorbed_limb_is_unknown_until_it_is_seen(
    short_still_time, catalogue, lemon, pear, forearm
) -> None:
    perception = short_still_time.perception(catalogue)
    resting = lemon(0.45, 0.15), pear(0.40, -0.2)
    settle(perception, short_still_time, *resting)
    seen = settle(perception, short_still_time, *resting, forearm(0.36, 0.19, 0.12), frames=30)
    assert (perception.absorbed_count, seen.hand_in_view) == (1, False)
    assert seen.object('lemon').state is None
    assert not seen.settled
    leaving = settle(perception, short_still_time, *resting, forearm(0.45, -0.02, 0.12), frames=3)
    assert leaving.hand_in_view
    seen = settle(perception, short_still_time, *resting, frames=10)
    assert [o.state for o in seen.objects] == [LEFT, RIGHT]
    assert seen.settled
    assert seen.unknown_objects == ()


def test_the_background_is_restored_when_an_absorbed_limb_leaves(
    short_still_time, catalogue, lemon, pear, forearm, robot_arm
) -> None:
    perception = short_still_time.perception(catalogue)
    before = perception.background
    start, end = pear(0.40, -0.2), pear(0.45, 0.15)
    settle(perception, short_still_time, start)
    for limb in (forearm(0.38, 0.15, 0.1), robot_arm(0.45, 0.1, 0.08)):
        settle(perception, short_still_time, start, limb, frames=25)
    assert perception.absorbed_count == 2
    settle(perception, short_still_time, start, frames=3)
    assert (perception.background.nearest == before.nearest).all()
    assert (perception.background.table == before.table).all()
    acts = []
    for y in (-0.2, -0.1, 0.0, 0.1, 0.15):
        for _ in range(2):
            held = pear(0.40, y, 0.10), forearm(0.47, y, 0.16)
            acts += perception.process(short_still_time.frame(*held)).demonstrations
    for _ in range(10):
        acts += perception.process(short_still_time.frame(end)).demonstrations
    assert [(a.object, a.x_i, a.x_f) for a in acts] == [('pear', RIGHT, LEFT)]


def test_objects_beside_and_below_the_table_are_not_reported(renderer, catalogue, lemon) -> None:
    red = replace(lemon(0.40, 0.50, -0.17), colour=(200, 20, 40))
    tall = replace(lemon(0.45, 0.50, -0.10), radius=0.08, colour=(200, 20, 40))
    for thing in (red, tall):
        assert settle(renderer.perception(catalogue), renderer, thing).unknown_objects == ()


def test_an_object_can_be_added_to_the_catalogue_from_frames(
    renderer, lemon, pear, tmp_path
) -> None:
    perception = renderer.perception(Catalogue(()))
    frame = renderer.frame(lemon(0.45, 0.15))
    sample = perception.largest_unknown(frame, perception.process(frame))
    assert sample is not None
    entry = catalogue_entry('banana', [sample])
    data = yaml.safe_load(world_path('chung2015').read_text())
    data['objects'] = yaml.safe_load(object_yaml(entry))
    del data['story']
    known = world_catalogue(parse_world(yaml.safe_dump(data), tmp_path / 'known.yaml'))
    assert known.objects == (entry,)
    seen = settle(renderer.perception(known), renderer, pear(0.4, -0.1), lemon(0.5, 0.2))
    assert seen.object('banana').state == LEFT
    assert len(seen.unknown_objects) == 1


def test_a_limb_with_the_colour_of_a_known_object_is_handled(renderer, catalogue, forearm) -> None:
    perception = renderer.perception(catalogue)
    painted = replace(forearm(0.62, 0.1, 0.03), colour=(235, 205, 40))
    seen = [perception.process(renderer.frame(painted)) for _ in range(3)]
    assert all(len(table.objects) == 2 for table in seen)


def test_an_object_still_moving_at_the_timeout_is_counted(
    renderer, catalogue, lemon, forearm
) -> None:
    renderer.config = replace(renderer.config, settle_timeout=0.5)
    perception = renderer.perception(catalogue)
    settle(perception, renderer, lemon(0.45, -0.25))
    settle(perception, renderer, lemon(0.40, -0.25), forearm(0.50, -0.25, 0.12), frames=3)
    seen = []
    for k in range(8):
        seen.append(perception.process(renderer.frame(lemon(0.40, -0.20 + 0.03 * k))))
    assert not any(table.demonstrations for table in seen)
    unresolved = [act for table in seen for act in table.unresolved]
    assert [(a.object, a.reason) for a in unresolved] == [('lemon', UnresolvedReason.MOVING)]
    assert perception.described()['acts not understood: object still moving'] == '1'
