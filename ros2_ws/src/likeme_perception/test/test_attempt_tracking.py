"""Attempts from scripted observations: under way, failed, put back, jitter, and whose they are."""

from __future__ import annotations

from dataclasses import replace
from math import nan

import pytest

from likeme_core.observations import ObservedAttempt
from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
from likeme_core.tabletop import Manner, State
from likeme_perception.config import world_config
from likeme_perception.demonstration_tracking import DemonstrationTracker
from likeme_perception.movement_direction import Point, moved_towards
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.state_probability import certain
from likeme_perception.top_view import Shape

PERIOD = 100_000_000
HOME = (0.44, 0.15, 0.03)
OTHER = (0.44, -0.18, 0.03)


def seen(name: str, place: Point, settled: bool = False) -> ObjectObservation:
    """An object in view."""
    state = WORLD.regions.state_of(*place)
    return ObjectObservation(
        name,
        state,
        certain(state, WORLD.regions),
        True,
        settled,
        Shape(place, 0, 0.07, 0.05, 0.05),
    )


class Script:
    """Feeds a tracker at 10 Hz: a lemon at HOME, and a pear that rests at OTHER."""

    def __init__(self) -> None:
        self.tracker, self.stamp = DemonstrationTracker(world_config(WORLD)), 0
        self.attempts: list[ObservedAttempt] = []
        self.demonstrations = 0
        self.rest(HOME)

    def frame(
        self, lemon: ObjectObservation, hand: bool, arm: bool = False,
        pear: ObjectObservation | None = None,
    ) -> None:  # fmt: skip
        self.stamp += PERIOD
        now = TableObservation(
            self.stamp, 'camera', True, hand, arm,
            objects=(lemon, pear or seen('pear', OTHER, settled=True)),
        )  # fmt: skip
        told = self.tracker.update(now)
        self.attempts += told.attempts
        self.demonstrations += len(told.demonstrations)

    def hand(self, *places: Point | None, arm: bool = False) -> None:
        """Each place of the lemon for two frames, with a hand in view; None: covered."""
        for place in places:
            lemon = ObjectObservation('lemon') if place is None else seen('lemon', place)
            for _ in range(2):
                self.frame(lemon, True, arm)

    def rest(self, place: Point, hand: bool = False) -> None:
        """The lemon at rest, for 0.6 s."""
        for _ in range(6):
            self.frame(seen('lemon', place, settled=True), hand)

    def told(self) -> list[tuple[str, State | None, State | None, bool]]:
        """Object, x_f, direction of each attempt, and whether it is under way."""
        return [(a.object, a.x_f, a.direction, a.under_way) for a in self.attempts]


def at(y: float, z: float = 0.03) -> Point:
    return (0.44, y, z)


@pytest.fixture
def script() -> Script:
    return Script()


def test_a_push_that_ends_short_is_told_under_way_and_when_it_has_ended(script: Script) -> None:
    script.hand(HOME, at(0.10), at(0.06), at(0.05))
    assert script.told() == [('lemon', None, None, True), ('lemon', None, RIGHT, True)]
    script.rest(at(0.05))
    assert script.told()[2:] == [('lemon', LEFT, RIGHT, False)]
    ended = script.attempts[-1]
    assert (ended.x_i, ended.manner) == (LEFT, Manner.PUSH)
    assert ended.manner_probability > 0.9
    assert ended.start == script.attempts[0].start < ended.end == ended.stamp
    assert ended.x_f_probability == certain(LEFT, WORLD.regions)
    assert script.demonstrations == 0


def test_a_push_that_is_put_back_is_towards_where_it_went(script: Script) -> None:
    script.hand(HOME, at(0.09), at(0.03), at(0.01), at(0.07), HOME)
    script.rest(HOME)
    assert script.told()[-1] == ('lemon', LEFT, RIGHT, False)


def test_what_is_lifted_and_let_fall_where_it_was_has_no_direction(script: Script) -> None:
    script.hand(HOME, at(0.15, 0.10), at(0.15, 0.13), at(0.15, 0.13))
    assert script.told() == [('lemon', None, None, True)]
    script.rest(HOME)
    assert script.told()[1:] == [('lemon', LEFT, None, False)]
    assert {a.manner for a in script.attempts} == {Manner.PLACE}


def test_what_is_let_fall_on_its_way_was_moved_to_where_it_was_carried(script: Script) -> None:
    script.hand(HOME, at(0.14, 0.14), at(0.05, 0.14), at(0.01, 0.03), at(-0.2), at(-0.36))
    script.rest(at(-0.36))
    assert script.told()[-1] == ('lemon', OFFTABLE, RIGHT, False)


def test_what_falls_straight_down_has_not_ended_in_the_air(script: Script) -> None:
    script.hand(HOME, at(0.15, 0.12))
    script.frame(seen('lemon', at(0.15, 0.07), settled=True), True)
    assert [a.under_way for a in script.attempts] == [True]
    script.hand(at(0.14), at(0.11))
    script.rest(at(0.11))
    assert [a.under_way for a in script.attempts] == [True, False]


def test_an_act_that_reaches_another_region_is_an_attempt_and_a_demonstration(
    script: Script,
) -> None:
    script.hand(HOME, at(0.10, 0.12), at(0.0, 0.13), at(-0.1, 0.12), at(-0.15, 0.05))
    script.rest(at(-0.15))
    assert script.told()[-1] == ('lemon', RIGHT, RIGHT, False)
    assert script.demonstrations == 1


def test_two_acts_of_one_visit_are_two_attempts(script: Script) -> None:
    script.hand(HOME, at(0.08), at(0.04))
    script.rest(at(0.04), hand=True)
    script.hand(at(0.04), at(0.09), HOME)
    script.rest(HOME)
    ended = [(a.x_i, a.x_f, a.direction) for a in script.attempts if not a.under_way]
    assert ended == [(LEFT, LEFT, RIGHT), (LEFT, LEFT, None)]


def test_jitter_of_what_rests_and_a_short_cover_are_no_attempts(script: Script) -> None:
    for k in range(20):
        script.hand((0.44 + 0.015 * (k % 2), 0.15 - 0.01 * (k % 3), 0.03 + 0.01 * (k % 2)))
    script.hand(None, None, HOME)
    script.rest(HOME)
    assert script.attempts == []


def test_one_frame_off_its_place_is_no_attempt(script: Script) -> None:
    script.hand(HOME)
    script.frame(seen('lemon', at(0.05)), True)
    script.hand(HOME)
    script.rest(HOME)
    assert script.attempts == []


def test_what_the_robot_moves_is_no_attempt(script: Script) -> None:
    for y in (0.1, 0.05, -0.1):
        script.frame(seen('lemon', at(y)), hand=False, arm=True)
    script.rest(at(-0.1))
    assert script.attempts == []


def test_with_hand_and_arm_in_view_nothing_begins_and_no_end_is_told(script: Script) -> None:
    script.hand(at(0.1), at(0.05), arm=True)
    script.rest(at(0.05))
    assert script.attempts == []
    script.hand(at(0.1), at(0.14))
    script.hand(at(0.14), arm=True)
    script.rest(HOME)
    assert [(x_f, under_way) for _, x_f, _, under_way in script.told()] == [
        (None, True), (None, False)
    ]  # fmt: skip


def test_an_act_whose_end_is_not_seen_ends_with_the_visit(script: Script) -> None:
    script.hand(HOME, at(0.1), at(0.05))
    for _ in range(60):
        script.frame(seen('lemon', at(0.05)), hand=False)
    assert script.told()[-1] == ('lemon', None, RIGHT, False)


def test_an_interrupted_act_has_ended_and_may_go_on(script: Script) -> None:
    script.hand(HOME, at(0.1), at(0.05))
    ended = script.tracker.interrupt(script.stamp).attempts
    assert [(a.x_f, a.under_way) for a in ended] == [(None, False)]


def test_out_of_sight_off_the_table(script: Script) -> None:
    gone = ObjectObservation('lemon', OFFTABLE, certain(OFFTABLE, WORLD.regions))
    script.hand(HOME, at(0.22), at(0.30))
    for _ in range(6):
        script.frame(replace(gone, settled=True), hand=False)
    assert script.told()[-1] == ('lemon', OFFTABLE, OFFTABLE, False)


@pytest.mark.parametrize(
    ('ys', 'lifted', 'vanished', 'expected'),
    [
        ((0.15, 0.10), False, False, None),
        ((0.15, 0.06), False, False, RIGHT),
        ((0.15, 0.06, 0.14), False, False, RIGHT),
        ((0.15, 0.26), False, False, OFFTABLE),
        ((0.15, -0.1), False, False, RIGHT),
        # Slid through RIGHT and off the table: which was meant is not known.
        ((0.15, -0.1), False, True, None),
        ((0.15, -0.1), True, False, RIGHT),
        ((0.15, -0.1, -0.36), True, False, OFFTABLE),
        ((0.15, 0.15), True, False, None),
    ],
)
def test_the_direction_of_a_path(
    ys: tuple[float, ...], lifted: bool, vanished: bool, expected: State | None
) -> None:
    path = [at(y) for y in ys]
    assert moved_towards(WORLD.regions, LEFT, path, lifted, vanished) == expected


def test_a_heading_to_a_corner_has_no_direction() -> None:
    # RIGHT lies ahead on one side, the end of the table on the other.
    path = [(0.44, 0.10, 0.03), (0.57, 0.03, 0.03)]
    assert moved_towards(WORLD.regions, LEFT, path, lifted=False) is None


def test_a_start_that_was_never_seen_is_no_place(script: Script) -> None:
    unseen = ObjectObservation(
        'lemon', OFFTABLE, certain(OFFTABLE, WORLD.regions), False, True,
        Shape((nan, nan, nan), 0, 0, 0, 0),
    )  # fmt: skip
    for _ in range(6):
        script.frame(unseen, hand=False)
    script.hand(at(0.28, 0.1), at(0.15, 0.1))
    script.rest(at(0.15))
    assert script.told()[-1] == ('lemon', LEFT, LEFT, False)
    assert {a.x_i for a in script.attempts} == {OFFTABLE}
