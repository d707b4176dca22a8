"""Demonstrations from scripted observations."""

from __future__ import annotations

from dataclasses import replace

import pytest

from likeme_core.observations import Demonstration
from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
from likeme_core.tabletop import Manner, State
from likeme_perception.config import world_config
from likeme_perception.demonstration_tracking import DemonstrationTracker
from likeme_perception.hand_tip import HandTip
from likeme_perception.observation import (
    ObjectObservation,
    TableObservation,
    UnresolvedAct,
    UnresolvedReason,
)
from likeme_perception.state_probability import certain
from likeme_perception.top_view import Shape

SECOND = 1_000_000_000
AT_LEFT, AT_RIGHT, OFF = (0.44, 0.18, 0.03), (0.44, -0.18, 0.03), (0.44, 0.50, -0.17)
HALFWAY, LIFTED = (0.44, 0.06, 0.03), (0.44, 0.06, 0.15)


def seen(name: str, place: tuple[float, float, float], settled: bool = True) -> ObjectObservation:
    """An object in view at a place."""
    _, y, z = place
    on_table = z > 0 and abs(y) < 0.33
    state = (LEFT if y > 0 else RIGHT) if on_table else OFFTABLE
    shape = Shape(place, 0.0, 0.07, 0.05, z + 0.03)
    return ObjectObservation(name, state, certain(state, WORLD.regions), True, settled, shape)


def covered(name: str) -> ObjectObservation:
    """An object under a hand or an arm."""
    return ObjectObservation(name)


def gone(name: str) -> ObjectObservation:
    """An object that is not visible."""
    return ObjectObservation(name, OFFTABLE, certain(OFFTABLE, WORLD.regions), False, True)


class Script:
    """Feeds a tracker at 10 Hz and stores the acts."""

    def __init__(self) -> None:
        self.tracker = DemonstrationTracker(world_config(WORLD))
        self.stamp = 0
        self.acts: list[Demonstration] = []
        self.unresolved: list[UnresolvedAct] = []

    def show(
        self,
        *objects: ObjectObservation,
        hand: bool = False,
        arm: bool = False,
        tip: HandTip | None = None,
        seconds: float = 0.5,
    ) -> None:
        for _ in range(round(seconds * 10)):
            self.stamp += SECOND // 10
            now = TableObservation(
                self.stamp,
                'camera',
                hand_in_view=hand,
                arm_in_view=arm,
                objects=objects,
                hand_tip=tip,
            )
            complete = self.tracker.update(now)
            self.acts += complete.demonstrations
            self.unresolved += complete.unresolved


@pytest.fixture
def script() -> Script:
    """A chicken at rest on the right, a pear at rest on the left."""
    s = Script()
    s.show(seen('chicken', AT_RIGHT), seen('pear', AT_LEFT))
    return s


def pear() -> ObjectObservation:
    """An object that is not moved."""
    return seen('pear', AT_LEFT)


def changes(script: Script) -> list[tuple[str, State, State]]:
    """Object, x_i and x_f of the demonstrations."""
    return [(a.object, a.x_i, a.x_f) for a in script.acts]


def unresolved(script: Script) -> list[tuple[str | None, UnresolvedReason]]:
    """Object and reason of the unresolved acts."""
    return [(u.object, u.reason) for u in script.unresolved]


def rolling(state: State) -> ObjectObservation:
    """The chicken, moving."""
    return seen('chicken', HALFWAY if state == LEFT else (0.44, -0.05, 0.03), settled=False)


def test_place_with_the_object_visible_in_the_hand(script: Script) -> None:
    start = script.stamp
    script.show(seen('chicken', AT_RIGHT), pear(), hand=True)
    script.show(seen('chicken', LIFTED, settled=False), pear(), hand=True)
    script.show(seen('chicken', AT_LEFT, settled=False), pear(), hand=True)
    left = script.stamp
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert changes(script) == [('chicken', RIGHT, LEFT)]
    act = script.acts[0]
    assert act.manner is Manner.PLACE
    assert act.manner_probability > 0.9
    assert act.rise == pytest.approx(0.12, abs=0.01)
    assert act.start == start + SECOND // 10
    assert act.end == left + SECOND // 10


def test_place_with_the_object_hidden_by_the_hand(script: Script) -> None:
    script.show(seen('chicken', AT_RIGHT), pear(), hand=True, tip=HandTip(0.44, -0.18, 0.20))
    for y, low in (
        (-0.18, 0.04),
        (-0.18, 0.10),
        (0.0, 0.15),
        (0.0, 0.15),
        (0.18, 0.10),
        (0.18, 0.04),
    ):
        tip = HandTip(0.44, y, low)
        script.show(covered('chicken'), pear(), hand=True, tip=tip, seconds=0.3)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert changes(script) == [('chicken', RIGHT, LEFT)]
    assert script.acts[0].manner is Manner.PLACE


def test_push_with_the_object_visible(script: Script) -> None:
    script.show(seen('chicken', AT_RIGHT), pear(), hand=True, tip=HandTip(0.44, -0.25, 0.2))
    script.show(seen('chicken', HALFWAY, settled=False), pear(), hand=True)
    script.show(
        seen('chicken', AT_LEFT, settled=False), pear(), hand=True, tip=HandTip(0.44, 0.1, 0.2)
    )
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert script.acts[0].manner is Manner.PUSH
    assert script.acts[0].manner_probability > 0.9


def test_push_with_the_object_hidden_by_the_hand(script: Script) -> None:
    script.show(seen('chicken', AT_RIGHT), pear(), hand=True, tip=HandTip(0.44, -0.18, 0.20))
    for y in (-0.18, -0.1, 0.0, 0.1, 0.18):
        tip = HandTip(0.44, y, 0.05)
        script.show(covered('chicken'), pear(), hand=True, tip=tip, seconds=0.3)
    script.show(covered('chicken'), pear(), hand=True, tip=HandTip(0.44, 0.18, 0.2))
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert script.acts[0].manner is Manner.PUSH


def test_a_hand_that_rises_after_a_push_over_the_edge_has_placed_nothing(script: Script) -> None:
    script.show(seen('chicken', AT_RIGHT), pear(), hand=True, tip=HandTip(0.44, -0.10, 0.20))
    for y in (-0.12, -0.2, -0.25, -0.3, -0.34):
        tip = HandTip(0.33, y, 0.02)
        script.show(covered('chicken'), pear(), hand=True, tip=tip, seconds=0.3)
    for x, low in ((0.45, 0.06), (0.5, 0.09), (0.55, 0.12)):
        tip = HandTip(x, -0.37, low)
        script.show(covered('chicken'), pear(), hand=True, tip=tip, seconds=0.2)
    script.show(seen('chicken', (0.44, -0.7, -0.17)), pear(), seconds=1)
    assert changes(script) == [('chicken', RIGHT, OFFTABLE)]
    assert script.acts[0].manner is Manner.PUSH


def test_a_short_place_in_a_hand_that_hides_the_object(script: Script) -> None:
    script.show(seen('chicken', (0.44, -0.05, 0.03)), pear(), seconds=1)
    for y, low in ((-0.05, 0.04), (-0.05, 0.15), (0.0, 0.15), (0.04, 0.15), (0.04, 0.04)):
        tip = HandTip(0.44, y, low)
        script.show(covered('chicken'), pear(), hand=True, tip=tip, seconds=0.3)
    script.show(seen('chicken', (0.44, 0.04, 0.03)), pear(), seconds=1)
    assert changes(script) == [('chicken', RIGHT, LEFT)]
    assert script.acts[0].manner is Manner.PLACE
    assert script.acts[0].manner_probability > 0.9


def test_a_hidden_object_under_a_hand_that_was_hardly_seen_leaves_the_manner_open(
    script: Script,
) -> None:
    tip = HandTip(0.44, -0.18, 0.04)
    script.show(covered('chicken'), pear(), hand=True, tip=tip, seconds=0.2)
    script.show(covered('chicken'), pear(), hand=True)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert changes(script) == [('chicken', RIGHT, LEFT)]
    assert script.acts[0].manner_probability < 0.6


def test_an_object_that_falls_off_the_table_had_been_lifted_where_it_was_hidden(
    script: Script,
) -> None:
    for y, low in ((-0.18, 0.04), (-0.18, 0.15), (-0.27, 0.16), (-0.3, 0.16), (-0.34, 0.16)):
        tip = HandTip(0.44, y, low)
        script.show(covered('chicken'), pear(), hand=True, tip=tip, seconds=0.2)
    for z in (-0.03, -0.07, -0.1, -0.13):
        falls = seen('chicken', (0.44, -0.4, z), settled=False)
        script.show(falls, pear(), hand=True, tip=HandTip(0.44, -0.34, 0.16), seconds=0.1)
    script.show(seen('chicken', (0.44, -0.5, -0.17)), pear(), seconds=1)
    assert changes(script) == [('chicken', RIGHT, OFFTABLE)]
    assert script.acts[0].manner is Manner.PLACE


@pytest.mark.parametrize(('missing', 'least', 'most'), [(0.1, 0.9, 1.0), (1.0, 0.5, 0.8)])
def test_frames_that_are_missing_leave_the_manner_open(
    script: Script, missing: float, least: float, most: float
) -> None:
    script.show(seen('chicken', AT_RIGHT), pear(), hand=True)
    script.show(seen('chicken', HALFWAY, settled=False), pear(), hand=True, seconds=0.5)
    script.stamp += round(missing * SECOND)
    script.show(seen('chicken', AT_LEFT), pear(), hand=True)
    script.show(seen('chicken', AT_LEFT), pear())
    assert script.acts[0].manner == Manner.PUSH
    assert least < script.acts[0].manner_probability < most


def test_a_rise_that_was_seen_stays_seen_if_frames_are_missing(script: Script) -> None:
    script.show(seen('chicken', AT_RIGHT), pear(), hand=True)
    script.show(seen('chicken', LIFTED, settled=False), pear(), hand=True)
    script.stamp += SECOND
    script.show(seen('chicken', AT_LEFT), pear(), hand=True)
    script.show(seen('chicken', AT_LEFT), pear())
    assert script.acts[0].manner == Manner.PLACE
    assert script.acts[0].manner_probability > 0.9


def test_an_act_does_not_wait_for_what_was_unknown_before(script: Script) -> None:
    others = seen('pear', AT_LEFT), covered('lemon')
    script.show(seen('chicken', AT_RIGHT), *others, hand=True)
    script.show(seen('chicken', AT_LEFT, settled=False), *others, hand=True)
    script.show(seen('chicken', AT_LEFT), *others)
    assert changes(script) == [('chicken', RIGHT, LEFT)]


def test_an_act_whose_hand_stops_counts_when_it_goes_on(script: Script) -> None:
    script.show(seen('chicken', AT_RIGHT), pear(), hand=True)
    assert script.tracker.interrupt(script.stamp).unresolved[0].reason == UnresolvedReason.STILL
    script.show(seen('chicken', LIFTED, settled=False), pear())
    script.show(seen('chicken', AT_LEFT, settled=False), pear(), hand=True)
    script.show(seen('chicken', AT_LEFT), pear())
    assert changes(script) == [('chicken', RIGHT, LEFT)]


def test_an_object_put_back_in_its_state_is_no_demonstration(script: Script) -> None:
    script.show(seen('chicken', LIFTED, settled=False), pear(), hand=True)
    script.show(seen('chicken', (0.40, -0.1, 0.03)), pear(), seconds=1)
    assert script.acts == []


def test_a_hand_that_passes_through_is_no_demonstration(script: Script) -> None:
    script.show(covered('chicken'), covered('pear'), hand=True)
    script.show(seen('chicken', AT_RIGHT), pear(), seconds=1)
    assert script.acts == []
    assert unresolved(script) == []


def test_what_lies_on_a_border_and_is_not_moved_is_no_demonstration(script: Script) -> None:
    on_border = seen('lemon', (0.40, 0.0001, 0.03))
    assert on_border.state == LEFT
    script.show(on_border, pear())
    script.show(on_border, covered('pear'), hand=True)
    other_side = seen('lemon', (0.40, -0.0001, 0.03))
    assert other_side.state == RIGHT
    script.show(other_side, seen('pear', AT_RIGHT), seconds=1)
    assert changes(script) == [('pear', LEFT, RIGHT)]
    # What the next act finds it to be is where it is seen now.
    script.show(seen('lemon', (0.40, 0.05, 0.03), settled=False), hand=True)
    script.show(seen('lemon', AT_LEFT), seconds=1)
    assert changes(script)[1:] == [('lemon', RIGHT, LEFT)]


def test_a_session_is_told_no_state_of_what_lies_on_a_border() -> None:
    pear, lemon = seen('pear', AT_LEFT), seen('lemon', (0.40, 0.0001, 0.03))
    unsure = replace(lemon, state_probability=(0.51, 0.49, 0.0))
    table = TableObservation(SECOND, 'camera', objects=(pear, unsure))
    assert table.snapshot.states == {'pear': LEFT}


def test_a_dropped_object_is_reported_where_it_comes_to_rest(script: Script) -> None:
    script.show(seen('chicken', LIFTED, settled=False), pear(), hand=True)
    script.show(seen('chicken', (0.44, 0.02, 0.10), settled=False), pear(), seconds=0.2)
    script.show(seen('chicken', (0.44, -0.02, 0.03), settled=False), pear(), seconds=0.4)
    assert script.acts == []
    script.show(seen('chicken', AT_LEFT), pear(), seconds=0.5)
    assert changes(script) == [('chicken', RIGHT, LEFT)]


def test_pushed_off_the_table_and_out_of_view(script: Script) -> None:
    script.show(seen('pear', AT_LEFT), seen('chicken', AT_RIGHT), hand=True)
    script.show(
        seen('pear', (0.44, 0.28, 0.03), settled=False), seen('chicken', AT_RIGHT), hand=True
    )
    script.show(
        seen('pear', (0.44, 0.35, 0.03), settled=False), seen('chicken', AT_RIGHT), hand=True
    )
    script.show(replace(gone('pear'), settled=False), seen('chicken', AT_RIGHT), hand=True)
    script.show(gone('pear'), seen('chicken', AT_RIGHT), seconds=1)
    assert changes(script) == [('pear', LEFT, OFFTABLE)]
    assert script.acts[0].manner is Manner.PUSH


def test_carried_off_the_table_is_a_place(script: Script) -> None:
    script.show(
        seen('pear', (0.44, 0.18, 0.12), settled=False), seen('chicken', AT_RIGHT), hand=True
    )
    script.show(
        seen('pear', (0.44, 0.30, 0.14), settled=False), seen('chicken', AT_RIGHT), hand=True
    )
    script.show(covered('pear'), seen('chicken', AT_RIGHT), hand=True)
    script.show(seen('pear', OFF), seen('chicken', AT_RIGHT), seconds=1)
    assert changes(script) == [('pear', LEFT, OFFTABLE)]
    assert script.acts[0].manner is Manner.PLACE


def test_two_objects_are_two_acts_in_the_order_they_moved(script: Script) -> None:
    script.show(seen('chicken', AT_RIGHT), seen('pear', HALFWAY, settled=False), hand=True)
    script.show(seen('chicken', HALFWAY, settled=False), seen('pear', AT_RIGHT), hand=True)
    script.show(seen('chicken', AT_LEFT), seen('pear', AT_RIGHT), seconds=1)
    assert changes(script) == [
        ('pear', LEFT, RIGHT),
        ('chicken', RIGHT, LEFT),
    ]


def test_acts_of_the_robot_are_no_demonstrations(script: Script) -> None:
    script.show(covered('chicken'), pear(), arm=True)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert script.acts == []


def test_hand_and_arm_in_view_together_are_an_unresolved_act(script: Script) -> None:
    script.show(covered('chicken'), pear(), hand=True, arm=True)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert script.acts == []
    assert unresolved(script) == [(None, UnresolvedReason.HAND_AND_ARM)]


def test_a_reset_of_the_table_is_no_demonstration(script: Script) -> None:
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert script.acts == []
    script.show(covered('chicken'), pear(), hand=True)
    script.show(seen('chicken', AT_RIGHT), pear(), seconds=1)
    assert changes(script) == [('chicken', LEFT, RIGHT)]


def test_a_hand_that_returns_before_all_is_at_rest_continues_its_act(script: Script) -> None:
    script.show(seen('chicken', HALFWAY, settled=False), pear(), hand=True)
    script.show(seen('chicken', HALFWAY, settled=False), pear(), seconds=0.2)
    script.show(seen('chicken', AT_LEFT, settled=False), pear(), hand=True)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert changes(script) == [('chicken', RIGHT, LEFT)]


@pytest.mark.parametrize('seconds', [1, 6])
def test_what_was_lost_when_a_hand_comes_back_is_no_demonstration_of_it(
    script: Script, seconds: float
) -> None:
    script.show(covered('chicken'), pear(), hand=True)
    script.show(covered('chicken'), pear(), seconds=seconds)
    script.show(covered('chicken'), pear(), hand=True)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert script.acts == []
    script.show(covered('chicken'), pear(), hand=True)
    script.show(seen('chicken', AT_RIGHT), pear(), seconds=1)
    assert changes(script) == [('chicken', LEFT, RIGHT)]


def test_a_hand_that_stops_what_rolls_continues_its_act(script: Script) -> None:
    script.show(rolling(LEFT), pear(), hand=True)
    script.show(rolling(LEFT), pear(), seconds=1.5)
    script.show(rolling(LEFT), pear(), hand=True)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert changes(script) == [('chicken', RIGHT, LEFT)]


def test_an_object_that_never_settles_does_not_block_the_others(script: Script) -> None:
    script.show(covered('chicken'), pear(), hand=True)
    script.show(seen('chicken', AT_LEFT), replace(pear(), settled=False), seconds=4.5)
    assert script.acts == []
    script.show(seen('chicken', AT_LEFT), replace(pear(), settled=False), seconds=1)
    assert changes(script) == [('chicken', RIGHT, LEFT)]
    assert unresolved(script) == []


def test_an_act_has_the_state_probabilities_of_its_observations(script: Script) -> None:
    unsure = replace(seen('chicken', AT_LEFT), state_probability=(0.7, 0.2, 0.1))
    script.show(covered('chicken'), pear(), hand=True)
    script.show(unsure, pear(), seconds=1)
    assert script.acts[0].x_f_probability == (0.7, 0.2, 0.1)
    assert script.acts[0].x_i_probability == (0.0, 1.0, 0.0)


def test_an_object_still_moving_at_the_timeout_is_an_unresolved_act(script: Script) -> None:
    script.show(rolling(LEFT), pear(), hand=True)
    script.show(rolling(LEFT), pear(), seconds=4.8)
    assert unresolved(script) == []
    script.show(rolling(LEFT), pear(), seconds=1)
    assert script.acts == []
    assert unresolved(script) == [('chicken', UnresolvedReason.MOVING)]
    assert script.tracker.unresolved == {UnresolvedReason.MOVING: 1}


def test_a_later_rest_is_not_attributed_to_the_next_act(script: Script) -> None:
    script.show(rolling(LEFT), pear(), hand=True)
    script.show(rolling(LEFT), pear(), seconds=6)
    script.show(rolling(LEFT), covered('pear'), hand=True)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert script.acts == []
    assert unresolved(script) == [('chicken', UnresolvedReason.MOVING)]


def test_an_act_after_a_later_rest_starts_from_there(script: Script) -> None:
    script.show(rolling(LEFT), pear(), hand=True)
    script.show(rolling(LEFT), pear(), seconds=6)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    script.show(rolling(LEFT), pear(), hand=True)
    script.show(seen('chicken', AT_RIGHT), pear(), seconds=1)
    assert changes(script) == [('chicken', LEFT, RIGHT)]


def test_an_object_brought_to_the_table_that_never_settles_is_unresolved(script: Script) -> None:
    script.show(gone('chicken'), pear(), seconds=1)
    script.show(rolling(RIGHT), pear(), hand=True)
    script.show(rolling(RIGHT), pear(), seconds=6)
    assert script.acts == []
    assert unresolved(script) == [('chicken', UnresolvedReason.MOVING)]


def test_an_act_interrupted_by_the_arm_is_unresolved(script: Script) -> None:
    script.show(rolling(LEFT), pear(), hand=True)
    script.show(rolling(LEFT), pear(), seconds=0.2)
    script.show(covered('chicken'), pear(), arm=True)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert script.acts == []
    assert unresolved(script) == [('chicken', UnresolvedReason.INTERRUPTED)]


def test_an_object_hidden_by_the_arm_and_not_moved_is_no_act(script: Script) -> None:
    script.show(covered('chicken'), pear(), hand=True)
    script.show(covered('chicken'), pear(), arm=True)
    script.show(seen('chicken', AT_RIGHT), pear(), seconds=1)
    assert script.acts == []
    assert unresolved(script) == []
    script.show(covered('chicken'), pear(), hand=True)
    script.show(seen('chicken', AT_LEFT), pear(), seconds=1)
    assert changes(script) == [('chicken', RIGHT, LEFT)]
